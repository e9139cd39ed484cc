/*
  -scene_page: one HTML file that shows the run in three dimensions. The page, the description of the scene and the surfaces
  of flexible bodies are written at the first frame, to a temporary file that is renamed when it is on the disk. Blocks of
  frames are appended; the file is complete after each of them, so that a run that is killed leaves all blocks written before.
  Every rank packs its own values of a frame, the first rank writes.
*/
#include "scene/extension.h"
#include "scene/output/channels.h"
#include "scene/output/files.h"
#include "scene/output/page_assets.h"
#include "scene/output/page_description.h"
#include "scene/output/page_frames.h"
#include "scene/output/page_mesh.h"
#include "scene/output/page_surface.h"
#include "scene/output/recorder.h"
#include "scene/output/table.h"
#include <numeric>

namespace hhtdae
{

namespace
{

constexpr std::size_t page_pose = 7; /* number of values per body: position of the centre of mass, quaternion x, y, z, w */

class Page : public Task
{
public:
  Page(Runtime &R, const OutputSettings &o) : Task(o.page_dt), file_(o.page), title_(o.page_title), most_nodes_((std::size_t)o.page_nodes)
  {
    const std::size_t slash = file_.find_last_of('/');
    if (title_.empty()) title_ = slash == std::string::npos ? file_ : file_.substr(slash + 1);
    from_equations = ChannelsFollowFromEquations(R);
  }

  PetscErrorCode begin(Runtime &R)
  {
    std::string fault;
    PetscMPIInt wrong = 0;
    PetscFunctionBegin;
    PetscCall(makeMeshes(R));
    placeAll(R);
    if (R.rank == 0)
      for (const SurfaceData &d : R.scene.surfaces) {
        const BodyData &b = R.scene.bodies[d.body];
        if (fault.empty()) fault = d.surface ? SurfaceFault(*d.surface, *b.flexible->model) : "the first rank has none";
        if (!fault.empty() && !wrong++) fault = "surface of " + b.name + ": " + fault;
      }
    PetscCallMPI(MPI_Bcast(&wrong, 1, MPI_INT, 0, R.scene.comm));
    PetscCheck(!wrong, R.scene.comm, PETSC_ERR_ARG_INCOMP, "%s", fault.c_str());
    if (R.rank == 0) {
      std::vector<PageField> fields;
      for (const SurfaceData &d : R.scene.surfaces)
        if (HasStress(*d.surface)) fields.push_back({d.surface.get(), modal_[d.body]});
      std::vector<PageNodes> moving;
      for (const auto &m : meshes_) {
        const Eigen::Map<const Eigen::Matrix3Xd> X(m->surface.point.data(), 3, (Eigen::Index)m->surface.point.size() / 3);
        moving.push_back({(std::size_t)X.cols(), m->stress});
        rest_.push_back(X.colwise() - Eigen::Vector3d(X.rowwise().mean()));
      }
      frames_ = PageFrames(tracks_, R.scene.channels.size(), fields, moving);
    }
    PetscFunctionReturn(0);
  }

  PetscErrorCode record(Runtime &R, Evaluation &e) override
  {
    std::vector<double> frame;
    PetscFunctionBegin;
    PetscCall(gather(R, e, frame));
    PetscCall(onFirst(R, [&] { return keep(R.scene, e.t, frame); }));
    PetscFunctionReturn(0);
  }

  PetscErrorCode finish(Runtime &R) override
  {
    PetscFunctionBegin;
    PetscCall(onFirst(R, [&] { return complete(); }));
    PetscFunctionReturn(0);
  }

  int slot() const override { return 3; }

  PetscErrorCode save(Runtime &R, double *x) override
  {
    PetscFunctionBegin;
    PetscCall(onFirst(R, [&] { return writeFrames(); }));
    x[0] = (double)end_;
    x[1] = dt;
    PetscFunctionReturn(0);
  }

  PetscErrorCode resume(Runtime &R, const double *x) override
  {
    PetscFunctionBegin;
    end_ = (long)x[0];
    dt   = x[1];
    PetscCall(onFirst(R, [&] { return end_ ? ShortenFile(file_, end_, &there_) : PetscErrorCode(0); }));
    PetscFunctionReturn(0);
  }

private:
  std::string                           file_, title_;
  std::vector<std::vector<std::size_t>> place_; /* for each rank: positions in a frame of the values that it packs */
  std::vector<std::size_t>              modal_; /* for each body: position in a frame of its modal coordinates */
  std::size_t                           tracks_ = 0, numbers_ = 0; /* numbers of values in a frame: before the channels, and in total */
  std::size_t                           most_nodes_;               /* largest number of nodes of all meshes together */
  std::vector<std::unique_ptr<PageMesh>> meshes_;
  std::vector<const Extension *>        mesh_of_;
  std::vector<Eigen::Matrix3Xd>         rest_;  /* for each mesh, on the first rank: positions of its undeformed nodes relative to their mean */
  PageFrames                            frames_; /* this and the following members are used on the first rank only */
  std::vector<double>                   last_; /* quaternions of the last frame */
  bool                                  there_ = false;
  long                                  end_   = 0; /* length of the file in bytes */

  /* Does work on the first rank. An error there is raised on all ranks, so that none waits for the first */
  template <class F> PetscErrorCode onFirst(const Runtime &R, const F &work) const
  {
    PetscFunctionBegin;
    const PetscErrorCode code   = R.rank == 0 ? work() : 0;
    PetscMPIInt          failed = code != 0;
    if (R.size > 1) PetscCallMPI(MPI_Bcast(&failed, 1, MPI_INT, 0, R.scene.comm));
    PetscCall(code);
    PetscCheck(!failed, PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "the first rank could not write the page %s", file_.c_str());
    PetscFunctionReturn(0);
  }

  PetscErrorCode keep(const SceneData &s, double t, std::vector<double> &frame)
  {
    PetscFunctionBegin;
    if (!there_) PetscCall(writeHead(s));
    for (std::size_t m = 0, at = tracks_ + s.channels.size(); m < meshes_.size(); at += meshes_[m]->perNode() * (std::size_t)rest_[m].cols(), m++)
      takeRigidMotion(rest_[m], &frame[at], &frame[page_pose * (s.bodies.size() + m)]);
    continueQuaternions(frame, s.bodies.size() + meshes_.size());
    frames_.add(t, frame.data(), frame.data() + tracks_, frame.data() + tracks_ + s.channels.size());
    if (frames_.full()) PetscCall(writeFrames());
    PetscFunctionReturn(0);
  }

  PetscErrorCode complete()
  {
    PetscFunctionBegin;
    if (!there_) PetscFunctionReturn(0);
    PetscCall(writeFrames());
    PetscCall(SyncFile(file_));
    PetscFunctionReturn(0);
  }

  static PetscMPIInt ownerOf(const Runtime &R, std::size_t body) { return R.number.owner.empty() ? 0 : R.number.owner[body]; }

  /* Makes the meshes; each has an equal share of the largest number of nodes */
  PetscErrorCode makeMeshes(const Runtime &R)
  {
    PetscFunctionBegin;
    for (const auto &x : R.scene.extensions) {
      std::unique_ptr<PageMesh> mesh;
      PetscCall(x->pageMesh(std::max((std::size_t)1, most_nodes_ / R.scene.extensions.size()), &mesh));
      if (!mesh) continue;
      meshes_.push_back(std::move(mesh));
      mesh_of_.push_back(x.get());
    }
    PetscFunctionReturn(0);
  }

  /* Converts positions x of nodes to displacements relative to the nearest rigid motion, and writes the pose of that motion */
  static void takeRigidMotion(const Eigen::Matrix3Xd &X, double *x, double *pose)
  {
    Eigen::Map<Eigen::Matrix3Xd> now(x, 3, X.cols());
    const RigidFit               fit = FitRigid(X, Eigen::Map<const Eigen::Matrix3Xd>(x, 3, X.cols()));
    const Eigen::Quaterniond     q(fit.R);
    now = (fit.R.transpose() * (now.colwise() - Eigen::Vector3d(fit.origin)) - X).eval();
    for (double y : {fit.origin(0), fit.origin(1), fit.origin(2), q.x(), q.y(), q.z(), q.w()}) *pose++ = y;
  }

  /* Sets the positions of all values in a frame: poses of all bodies, poses of the meshes (which the first rank
     computes), modal coordinates of the flexible bodies, channels, nodes of the meshes */
  void placeAll(const Runtime &R)
  {
    const std::vector<BodyData> &bodies = R.scene.bodies;
    place_.resize(R.size);
    const auto put = [&](PetscMPIInt rank, std::size_t n) {
      for (std::size_t k = 0; k < n; k++) place_[rank].push_back(tracks_++);
    };
    for (std::size_t b = 0; b < bodies.size(); b++) put(ownerOf(R, b), page_pose);
    tracks_ += page_pose * meshes_.size();
    for (std::size_t b = 0; b < bodies.size(); b++) {
      modal_.push_back(tracks_);
      if (bodies[b].flexible) put(ownerOf(R, b), (std::size_t)bodies[b].flexible->model->modes());
    }
    for (std::size_t c = 0; c < ChannelOwners(R).size(); c++) place_[ChannelOwners(R)[c]].push_back(tracks_ + c);
    numbers_ = tracks_ + ChannelOwners(R).size();
    for (const auto &m : meshes_) {
      const std::size_t all = (std::size_t)std::accumulate(m->nodes.begin(), m->nodes.end(), 0);
      std::size_t       first = 0; /* first node of a rank */
      for (PetscMPIInt r = 0; r < R.size; first += (std::size_t)m->nodes[r++]) {
        for (std::size_t k = 3 * first; k < 3 * (first + (std::size_t)m->nodes[r]); k++) place_[r].push_back(numbers_ + k);
        if (m->stress)
          for (std::size_t k = first; k < first + (std::size_t)m->nodes[r]; k++) place_[r].push_back(numbers_ + 3 * all + k);
      }
      numbers_ += m->perNode() * all;
    }
  }

  PetscErrorCode pack(const Runtime &R, const Evaluation &e, std::vector<double> &mine) const
  {
    PetscFunctionBegin;
    for (std::size_t b = 0; b < R.local_body.size(); b++) {
      if (ownerOf(R, b) != R.rank) continue;
      const BodyMotion        &m = R.bodies.now[R.local_body[b]];
      const Eigen::Quaterniond q(m.A);
      for (double x : {m.r(0), m.r(1), m.r(2), q.x(), q.y(), q.z(), q.w()}) mine.push_back(x);
    }
    for (std::size_t b = 0; b < R.local_body.size(); b++) {
      const BodyData &d = R.scene.bodies[b];
      if (ownerOf(R, b) != R.rank || !d.flexible) continue;
      const double *eta = e.u + R.bodies.body[R.local_body[b]].first + 6;
      mine.insert(mine.end(), eta, eta + d.flexible->model->modes());
    }
    PetscCall(ChannelValues(R, e, mine));
    for (std::size_t m = 0; m < meshes_.size(); m++) PetscCall(meshes_[m]->values(e.u + mesh_of_[m]->start[R.rank] - R.start, mine));
    PetscFunctionReturn(0);
  }

  PetscErrorCode gather(const Runtime &R, const Evaluation &e, std::vector<double> &frame) const
  {
    std::vector<double> mine, all;
    std::vector<int>    count(R.size), start(R.size + 1, 0);
    PetscFunctionBegin;
    PetscCall(pack(R, e, mine));
    for (PetscMPIInt r = 0; r < R.size; r++) {
      count[r]     = (int)place_[r].size();
      start[r + 1] = start[r] + count[r];
    }
    if (R.rank == 0) all.resize(start[R.size]);
    PetscCallMPI(MPI_Gatherv(mine.data(), (int)mine.size(), MPI_DOUBLE, all.data(), count.data(), start.data(), MPI_DOUBLE, 0, R.scene.comm));
    frame.assign(R.rank == 0 ? numbers_ : 0, 0);
    const double *x = all.data();
    if (R.rank == 0)
      for (const auto &places : place_)
        for (std::size_t k : places) frame[k] = *x++;
    PetscFunctionReturn(0);
  }

  /* Of the two quaternions of each rotation, chooses the one nearer to that of the previous frame, since tracks without jumps compress better. */
  void continueQuaternions(std::vector<double> &frame, std::size_t bodies)
  {
    last_.resize(4 * bodies, 0);
    for (std::size_t b = 0; b < bodies; b++) {
      Eigen::Map<Eigen::Vector4d> now(&frame[page_pose * b + 3]), last(&last_[4 * b]);
      if (now.dot(last) < 0) now = -now;
      last = now;
    }
  }

  PetscErrorCode writeHead(const SceneData &s)
  {
    std::string head = PageHead(), element;
    PetscFunctionBegin;
    head += "<script id=\"scene\" type=\"application/json\">" + DescribePage(s, title_, meshes_) + "</script>\n";
    for (const SurfaceData &d : s.surfaces) {
      PetscCall(PageElement(EncodeSurface(*d.surface, *s.bodies[d.body].flexible->model), "surface", &element));
      head += element;
    }
    for (std::size_t m = 0; m < meshes_.size(); m++) {
      Surface   from_mean = meshes_[m]->surface; /* EncodeSurface() stores coordinates relative to the body's centre of mass */
      ModalBody none;
      Eigen::Map<Eigen::Matrix3Xd>(from_mean.point.data(), 3, rest_[m].cols()) = rest_[m];
      from_mean.shape.resize(3 * rest_[m].cols(), 0);
      PetscCall(PageElement(EncodeSurface(from_mean, none), "surface", &element));
      head += element;
    }
    PetscCall(WriteWhole(file_, head));
    end_   = (long)head.size();
    there_ = true;
    PetscFunctionReturn(0);
  }

  PetscErrorCode writeFrames()
  {
    std::string element;
    PetscFunctionBegin;
    if (!frames_.frames()) PetscFunctionReturn(0);
    PetscCall(PageElement(frames_.encode(), "frames", &element));
    PetscCall(AppendText(file_, false, element, &end_));
    frames_.clear();
    last_.clear();
    PetscFunctionReturn(0);
  }
};

} // namespace

PetscErrorCode MakePage(Runtime &R, const OutputSettings &o, std::unique_ptr<Task> &task)
{
  PetscFunctionBegin;
  if (o.page.empty()) PetscFunctionReturn(0);
  PetscCheck(!PageHead().empty(), R.scene.comm, PETSC_ERR_SUP, "cannot write the page %s: the library was built without %s", o.page.c_str(), PageLacks());
  PetscCheck(R.scene.channels.size() == ChannelOwners(R).size(), R.scene.comm, PETSC_ERR_ARG_WRONGSTATE,
             "channel %s came too late: the scene is fixed from its set-up or first run on", R.scene.channels.back().name.c_str());
  auto page = std::make_unique<Page>(R, o);
  PetscCall(page->begin(R));
  task = std::move(page);
  PetscFunctionReturn(0);
}

} // namespace hhtdae
