/*
  -scene_animation PREFIX: ParaView opens PREFIX.pvd, an index of times and files of VTK's XML PolyData, one file per frame.
  The first rank gathers the poses of the bodies, moves the mesh and writes the files. Cell data: number and speed of the
  body.
*/
#include "scene/output/mesh.h"
#include "scene/output/recorder.h"
#include "scene/output/table.h"
#include "scene/output/vtp.h"
#include <cstdio>

namespace hhtdae
{

namespace
{

constexpr int animated_pose = 13; /* number of values per body: r, A by columns, |v| */

class Animation : public Task
{
public:
  Animation(const OutputSettings &o) : Task(o.animation_dt), prefix_(o.animation)
  {
    const std::size_t slash = prefix_.find_last_of('/');
    base_                   = slash == std::string::npos ? prefix_ : prefix_.substr(slash + 1);
  }

  PetscErrorCode begin(Runtime &R)
  {
    PetscFunctionBegin;
    own_.resize(R.size);
    for (std::size_t b = 0; b < R.scene.bodies.size(); b++) own_[R.number.owner.empty() ? 0 : R.number.owner[b]].push_back((PetscInt)b);
    if (R.rank) PetscFunctionReturn(0);
    mesh_ = MakeMesh(R.scene);
    PetscFunctionReturn(0);
  }

  PetscErrorCode record(Runtime &R, Evaluation &e) override
  {
    std::vector<double> pose;
    PetscFunctionBegin;
    PetscCall(gather(R, pose));
    if (R.rank == 0) {
      char number[16];
      std::snprintf(number, sizeof number, "_%06d", (int)frame_);
      PetscCall(WriteVTP(prefix_ + number + ".vtp", frame(pose)));
      if (!end_) PetscCall(writeIndex());
      PetscCall(writeIndex(e.t, base_ + number + ".vtp"));
    }
    frame_++;
    PetscFunctionReturn(0);
  }

  int slot() const override { return 1; }

  PetscErrorCode save(Runtime &, double *x) override
  {
    x[0] = frame_;
    x[1] = (double)end_;
    return 0;
  }

  /* Frames after the checkpoint are overwritten, and their entries in the index removed */
  PetscErrorCode resume(Runtime &R, const double *x) override
  {
    bool there = false;
    PetscFunctionBegin;
    frame_ = (PetscInt)x[0];
    end_   = (long)x[1];
    if (R.rank || !end_) PetscFunctionReturn(0);
    PetscCall(ShortenFile(prefix_ + ".pvd", end_, &there));
    if (!there) end_ = 0;
    else PetscCall(closeIndex());
    PetscFunctionReturn(0);
  }

private:
  std::string                        prefix_, base_;
  std::vector<std::vector<PetscInt>> own_; /* bodies of every rank */
  Mesh                               mesh_;
  PetscInt                           frame_ = 0;
  long                               end_   = 0; /* position in the index file, in bytes, after its last entry */

  /* pose: poses of all bodies, on the first rank */
  PetscErrorCode gather(const Runtime &R, std::vector<double> &pose)
  {
    std::vector<double> mine, all;
    std::vector<int>    count(R.size), start(R.size + 1, 0);
    PetscFunctionBegin;
    for (PetscInt id : own_[R.rank]) {
      const PetscInt    b = R.local_body[id];
      const BodyMotion &m = R.bodies.now[b];
      mine.insert(mine.end(), m.r.data(), m.r.data() + 3);
      mine.insert(mine.end(), m.A.data(), m.A.data() + 9);
      mine.push_back(m.v.norm());
    }
    for (PetscMPIInt r = 0; r < R.size; r++) {
      count[r]     = animated_pose * (int)own_[r].size();
      start[r + 1] = start[r] + count[r];
    }
    if (R.rank == 0) all.resize(start[R.size]);
    PetscCallMPI(MPI_Gatherv(mine.data(), (int)mine.size(), MPI_DOUBLE, all.data(), count.data(), start.data(), MPI_DOUBLE, 0, R.scene.comm));
    pose.resize(all.size());
    const double *x = all.data();
    if (R.rank == 0)
      for (const auto &bodies : own_)
        for (PetscInt id : bodies) {
          std::copy(x, x + animated_pose, pose.data() + animated_pose * id);
          x += animated_pose;
        }
    PetscFunctionReturn(0);
  }

  PolyData frame(const std::vector<double> &pose) const
  {
    PolyData d;
    for (const Mesh::Point &p : mesh_.point) {
      Vector3 x = p.s;
      if (p.body >= 0) {
        const double *b = pose.data() + animated_pose * p.body;
        x               = Eigen::Map<const Vector3>(b) + Eigen::Map<const Matrix3>(b + 3) * p.s;
      }
      for (int i = 0; i < 3; i++) d.points.push_back((float)x(i));
    }
    for (const Mesh::Cells *c : {&mesh_.lines, &mesh_.polygons}) {
      PolyData::Cells &out = c == &mesh_.lines ? d.lines : d.polygons;
      out.point.assign(c->point.begin(), c->point.end());
      out.end.assign(c->end.begin(), c->end.end());
      for (PetscInt b : c->body) { /* lines come before polygons, since VTK numbers cells in this order */
        d.body.push_back((int)b);
        d.speed.push_back(b < 0 ? 0.f : (float)pose[animated_pose * b + animated_pose - 1]);
      }
    }
    return d;
  }

  /* Writes the closing tags of the index, so that it is complete after every frame; the next entry overwrites them. */
  PetscErrorCode closeIndex()
  {
    long end = 0;
    PetscFunctionBegin;
    PetscCall(AppendText(prefix_ + ".pvd", false, "</Collection>\n</VTKFile>\n", &end));
    PetscFunctionReturn(0);
  }

  PetscErrorCode writeIndex(double t = 0, const std::string &file = "")
  {
    const std::string name = prefix_ + ".pvd";
    FILE             *out  = std::fopen(name.c_str(), file.empty() ? "w" : "r+");
    PetscFunctionBegin;
    PetscCheck(out, PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN, "cannot write the animation into %s: does its directory exist?", name.c_str());
    if (file.empty()) {
      std::fputs("<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\">\n<Collection>\n", out);
    } else {
      std::fseek(out, end_, SEEK_SET);
      std::fprintf(out, "<DataSet timestep=\"%.17g\" part=\"0\" file=\"%s\"/>\n", t, XMLText(file).c_str());
    }
    end_ = std::ftell(out);
    std::fputs("</Collection>\n</VTKFile>\n", out);
    const bool written = !std::ferror(out);
    PetscCheck(std::fclose(out) == 0 && written, PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "writing the animation's index %s failed", name.c_str());
    PetscFunctionReturn(0);
  }
};

} // namespace

PetscErrorCode MakeAnimation(Runtime &R, const OutputSettings &o, std::unique_ptr<Task> &task)
{
  PetscFunctionBegin;
  if (o.animation.empty()) PetscFunctionReturn(0);
  auto a = std::make_unique<Animation>(o);
  PetscCall(a->begin(R));
  task = std::move(a);
  PetscFunctionReturn(0);
}

} // namespace hhtdae
