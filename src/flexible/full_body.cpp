/* FullFeBody: adds a finite-element model to a scene, and reads its positions from a run */
#include "flexible/full_body.h"
#include "flexible/assembly.h"
#include "flexible/attachments.h"
#include "flexible/body_check.h"
#include "flexible/diagnose.h"
#include "flexible/exchange.h"
#include "scene/runtime.h"
#include <algorithm>
#include <cmath>

namespace hhtdae
{

PetscMPIInt FullExtension::ownerOf(PetscInt node) const
{
  return (PetscMPIInt)(std::upper_bound(node_first.begin(), node_first.end(), node) - node_first.begin()) - 1;
}

PetscInt FullExtension::number(PetscInt node) const
{
  const PetscMPIInt r = ownerOf(node);
  return start[r] + 3 * (node - node_first[r]);
}

PetscInt FullExtension::multiplier(PetscMPIInt r, PetscInt i) const { return start[r] + 3 * (node_first[r + 1] - node_first[r]) + i; }

std::string FullExtension::nameOf(PetscMPIInt rank, PetscInt unknown) const
{
  static const char axis[] = "xyz";
  const PetscInt    node   = node_first[rank] + unknown / 3;
  if (node >= node_first[rank + 1]) return "an attachment of body " + name;
  return std::string(1, axis[unknown % 3]) + " of node " + std::to_string(node) + " (from 0) of body " + name;
}

void FullExtension::initial(double *x, double *y) const
{
  std::copy(u.begin(), u.end(), x);
  std::copy(v.begin(), v.end(), y);
}

void FullExtension::startFrom(const double *x, const double *y)
{
  std::copy(x, x + u.size(), u.begin());
  std::copy(y, y + v.size(), v.begin());
}

void FullExtension::localize(Localizer &l, std::vector<std::unique_ptr<Batch>> &batches) const
{
  if (spec.law == FeLaw::Small) LocalizeMatrices(*this, l, batches);
  else LocalizeElements(*this, l, batches);
  LocalizeTies(*this, l, batches);
}

namespace
{

/* A node of an attachment, with its weight */
struct SetNode {
  PetscInt node;
  double   X[3], weight;
};

std::string ProblemOf(const FeModel &m, const FullBody &b)
{
  if (!m.M || (b.law == FeLaw::Small && !m.K)) return "the FE model has no matrices; read or set them first";
  if (!(b.rotation.transpose() * b.rotation - Matrix3::Identity()).isZero(1e-8) || b.rotation.determinant() < 0)
    return "rotation must be orthonormal and right-handed";
  if (!b.position.allFinite() || !b.velocity.allFinite() || !b.angular_velocity.allFinite()) return "position and velocities must be finite";
  if (!(b.mass_damping >= 0) || !(b.stiffness_damping >= 0) || std::isinf(b.mass_damping + b.stiffness_damping)) return "damping coefficients must be finite and not negative";
  if (b.law == FeLaw::Large && b.stiffness_damping != 0) return "damping in proportion to K goes with FeLaw::Small alone";
  if ((PetscInt)m.coordinates.size() != 3 * m.own) return "the FE model has no coordinates of its nodes; give them with the matrices";
  return "";
}

/* Sends each element to every rank that owns one of its nodes */
PetscErrorCode DistributeElements(FullExtension &x)
{
  const FeModel                      &m = *x.model;
  std::vector<std::vector<FeElement>> out(x.node_first.size() - 1);
  std::vector<std::size_t>            from;
  PetscFunctionBegin;
  for (const FeElement &e : m.elements) {
    std::vector<PetscMPIInt> to;
    for (int i = 0; i < FeNodes(e.type); i++) to.push_back(x.ownerOf(e.node[i]));
    std::sort(to.begin(), to.end());
    to.erase(std::unique(to.begin(), to.end()), to.end());
    for (PetscMPIInt r : to) out[r].push_back(e);
  }
  PetscCall(Exchange(m.comm, out, &x.elements, &from));
  FeModel here(m.comm); /* only for the exchange of nodal values */
  here.elements = x.elements;
  here.own      = m.own;
  ElementNodes nodes;
  PetscCall(nodes.setUp(here));
  x.near = nodes.global;
  x.near_x.resize(3 * x.near.size() + 1);
  PetscCall(nodes.bring(3, m.coordinates.data(), x.near_x.data()));
  for (std::size_t i = 0; i < x.near.size(); i++) {
    const Vector3 p = x.placed(&x.near_x[3 * i]);
    std::copy(p.data(), p.data() + 3, &x.near_x[3 * i]);
  }
  PetscFunctionReturn(0);
}

/* Gathers the nodes of an attachment on every rank, in the order of their global numbers */
PetscErrorCode Gather(const FeModel &m, const Attachment &a, std::vector<SetNode> *all)
{
  std::vector<PetscInt> own;
  std::vector<double>   weight;
  std::vector<SetNode>  mine;
  PetscFunctionBegin;
  for (PetscInt n : m.sets.at(a.set.empty() ? a.name : a.set)) own.push_back(n - m.first);
  PetscCall(WeightsOfNodes(m, a, own, &weight));
  for (std::size_t i = 0; i < own.size(); i++) {
    const double *X = &m.coordinates[3 * own[i]];
    mine.push_back({m.first + own[i], {X[0], X[1], X[2]}, weight[i]});
  }
  PetscCall(GatherAll(m.comm, mine, all));
  std::sort(all->begin(), all->end(), [](const SetNode &p, const SetNode &q) { return p.node < q.node; });
  PetscFunctionReturn(0);
}

/* Sets up the tie of an attachment, which CheckAttachments() must have accepted; *point: its position in the axes of the FE model */
PetscErrorCode MakeTie(FullExtension &x, const Attachment &a, Vector3 *point)
{
  const FeModel       &m = *x.model;
  std::vector<SetNode> nodes;
  TieNodes             t;
  PetscMPIInt          rank;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(m.comm, &rank));
  PetscCall(Gather(m, a, &nodes));
  double sum = 0;
  *point     = Vector3::Zero();
  for (std::size_t i = 0; i < nodes.size(); i++) {
    t.node.push_back(nodes[i].node);
    t.weight.push_back(nodes[i].weight);
    sum += t.weight.back();
    *point += t.weight.back() * Eigen::Map<const Vector3>(nodes[i].X);
  }
  *point = a.at_given ? a.position : Vector3(*point / sum);
  for (std::size_t i = 0; i < nodes.size(); i++) {
    t.weight[i] /= sum;
    t.arm.push_back(Eigen::Map<const Vector3>(nodes[i].X) - *point);
  }
  t.tie = a.tie;
  if (t.tie == Tie::Rigid) {
    std::vector<PetscInt> next(x.node_first.size(), 0);
    next[rank] = x.own_multipliers;
    /* numbers continue from the count of each owner, and every rank continues them for all owners */
    PetscCallMPI(MPI_Allgather(MPI_IN_PLACE, 0, MPI_DATATYPE_NULL, next.data(), 1, MPIU_INT, m.comm));
    for (PetscInt n : t.node) {
      PetscInt &i = next[x.ownerOf(n)];
      t.lambda.push_back(i);
      i += 3;
    }
    x.own_multipliers = next[rank];
  } else {
    t.owner = x.ownerOf(t.node[0]);
    t.first = x.own_multipliers;
    PetscCallMPI(MPI_Bcast(&t.first, 1, MPIU_INT, t.owner, m.comm));
    if (t.owner == rank) x.own_multipliers += 6;
  }
  x.ties.push_back(t);
  PetscFunctionReturn(0);
}

/* Adds the frame of an attachment as a massless body, with the velocity of the undeformed body */
Body AddFrame(Scene &scene, const FullExtension &x, const std::string &name, const Vector3 &point, double mass, double size)
{
  BodyData f;
  f.name          = name;
  f.inertia       = Matrix3::Zero();
  f.center        = Vector3::Zero();
  f.r             = x.placed(point.data());
  f.A             = x.spec.rotation;
  f.v             = x.spec.velocity + x.spec.angular_velocity.cross(f.r - x.spec.position);
  f.w             = x.spec.angular_velocity;
  f.massless      = true;
  f.light_mass    = 1e-3 * mass;
  f.light_inertia = 1e-3 * mass * size * size;
  f.fixed_start   = true; /* the nodes do not move in the assembly phase */
  DataOf(scene).bodies.push_back(f);
  return Body{(PetscInt)DataOf(scene).bodies.size() - 1, DataOf(scene).number};
}

/* Mass and bounding box of the body, as scales for light masses and the size of the scene */
PetscErrorCode MassAndBox(const FeModel &m, double *mass, Vector3 corner[2])
{
  Vec    one, M1;
  double box[6], all[6];
  PetscFunctionBegin;
  PetscCall(MatCreateVecs(m.M, &one, &M1));
  PetscCall(VecSet(one, 1));
  PetscCall(MatMult(m.M, one, M1));
  PetscCall(VecDot(one, M1, mass));
  *mass /= 3;
  PetscCall(VecDestroy(&one));
  PetscCall(VecDestroy(&M1));
  for (int k = 0; k < 6; k++) box[k] = -PETSC_INFINITY;
  for (std::size_t i = 0; i < m.coordinates.size(); i++) {
    box[i % 3]     = std::max(box[i % 3], m.coordinates[i]);
    box[3 + i % 3] = std::max(box[3 + i % 3], -m.coordinates[i]);
  }
  PetscCallMPI(MPI_Allreduce(box, all, 6, MPI_DOUBLE, MPI_MAX, m.comm));
  corner[0] = -Vector3(all[3], all[4], all[5]);
  corner[1] = Vector3(all[0], all[1], all[2]);
  PetscFunctionReturn(0);
}

/* Scene and model must have the same ranks, because nodes and unknowns are numbered by rank */
PetscErrorCode CheckRanks(const Scene &scene, const std::string &name, const FeModel &model)
{
  const MPI_Comm comm = DataOf(scene).comm;
  PetscMPIInt    same;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_compare(comm, model.comm, &same));
  PetscCheck(same == MPI_IDENT || same == MPI_CONGRUENT, PETSC_COMM_SELF, PETSC_ERR_ARG_NOTSAMECOMM,
             "finite-element body %s: its FE model is distributed over other ranks than the scene; make the model on the communicator of the scene, or a scene on that of the model",
             name.c_str());
  PetscFunctionReturn(0);
}

/* Reports a mesh of several unconnected parts. This may be intended, or coincident nodes were not merged; then a part would fall off, which
   only pictures show. */
PetscErrorCode TellParts(const FullExtension &x)
{
  const FeModel    &m = *x.model;
  std::vector<Tied> tied;
  std::string       parts;
  PetscFunctionBegin;
  if (!m.K) PetscFunctionReturn(0);
  for (const TieNodes &t : x.ties) { /* both kinds of ties connect the nodes of an attachment */
    tied.emplace_back();
    tied.back().tie = Tie::Rigid;
    for (PetscInt n : t.node)
      if (n >= m.first && n < m.first + m.own) tied.back().node.push_back(n - m.first);
  }
  PetscCall(DescribeParts(m, tied, &parts));
  if (!parts.empty())
    PetscCall(PetscPrintf(m.comm, "finite-element body %s: its mesh falls into %s (are coincident nodes not merged?)\n", x.name.c_str(), parts.c_str()));
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode FullFeBody::add(Scene &scene, const std::string &given, const FeModel &model, const FullBody &body)
{
  auto        x = std::make_unique<FullExtension>();
  PetscMPIInt rank, size;
  double      mass;
  Vector3     corner[2];
  PetscFunctionBegin;
  const std::string name    = given.empty() ? "fe body " + std::to_string(DataOf(scene).extensions.size()) : given,
                    problem = DataOf(scene).planar ? "it needs a scene in space" : ProblemOf(model, body);
  PetscCall(CheckRanks(scene, name, model));
  PetscCall(Agree(model.comm, problem.empty() ? "" : "finite-element body " + name + ": " + problem, PETSC_ERR_ARG_WRONG));
  PetscCall(CheckAttachments(model, body.attachments));
  PetscCallMPI(MPI_Comm_rank(model.comm, &rank));
  PetscCallMPI(MPI_Comm_size(model.comm, &size));
  x->name  = name;
  x->spec  = body;
  x->model = &model;
  x->node_first.resize(size + 1);
  PetscCallMPI(MPI_Allgather(&model.first, 1, MPIU_INT, x->node_first.data(), 1, MPIU_INT, model.comm));
  x->node_first[size] = model.nodes;
  for (PetscInt n = 0; n < model.own; n++) {
    const Vector3 p = x->placed(&model.coordinates[3 * n]), w = body.velocity + body.angular_velocity.cross(p - body.position);
    x->u.insert(x->u.end(), p.data(), p.data() + 3);
    x->v.insert(x->v.end(), w.data(), w.data() + 3);
  }
  if (body.law == FeLaw::Large) {
    PetscInt mine = (PetscInt)model.elements.size(), all;
    PetscCallMPI(MPI_Allreduce(&mine, &all, 1, MPIU_INT, MPI_SUM, model.comm));
    PetscCheck(all > 0, model.comm, PETSC_ERR_ARG_WRONG, "finite-element body %s: large displacements need elements, which this model does not have",
               name.c_str());
    PetscCall(CheckElements(model, "finite-element body " + name + ": FeLaw::Large"));
    PetscCall(DistributeElements(*x));
  } else {
    PetscCall(ExtractBlocks(*x));
  }
  PetscCall(MassAndBox(model, &mass, corner));
  std::vector<Vector3> point(body.attachments.size());
  for (std::size_t i = 0; i < point.size(); i++) PetscCall(MakeTie(*x, body.attachments[i], &point[i]));
  PetscCall(TellParts(*x));
  /* No error occurs below: a faulty description returns above, before it has changed the scene, and a recorded one can be repeated when
     parameters change */
  SceneAccess::record(scene, [=, &model](Scene &s) {
    if (FullFeBody().add(s, name, model, body)) DataOf(s).errors.push_back("finite-element body " + name + " could not be added anew");
  });
  DataOf(scene).refuseLate("finite-element body " + name);
  const double extent = (corner[1] - corner[0]).norm();
  /* Adds the corners of the bounding box as markers: a scene computes its size from bodies and markers, which would include only the
     attachments of this body */
  for (const Vector3 &c : corner) DataOf(scene).markers.push_back({-1, x->placed(c.data()), Matrix3::Identity()});
  for (std::size_t i = 0; i < point.size(); i++) {
    const std::string &attachment = body.attachments[i].name;
    const Body         frame      = AddFrame(scene, *x, name + "." + attachment, point[i], mass, extent);
    DataOf(scene).markers.push_back({frame.id, Vector3::Zero(), Matrix3::Identity()});
    x->ties[i].frame    = Marker{(PetscInt)DataOf(scene).markers.size() - 1};
    frames_[attachment] = frame;
  }
  name_      = name;
  scene_     = DataOf(scene).number;
  model_     = SceneAccess::model(scene);
  extension_ = (PetscInt)DataOf(scene).extensions.size();
  DataOf(scene).extensions.push_back(std::move(x));
  PetscFunctionReturn(0);
}

Body FullFeBody::attachment(const std::string &name) const
{
  const auto found = frames_.find(name);
  if (found != frames_.end()) return found->second;
  if (const auto model = model_.lock()) {
    std::string known;
    for (const auto &f : frames_) known += (known.empty() ? "" : ", ") + f.first;
    model->scene.errors.push_back("finite-element body " + name_ + ": it has no attachment " + name + (known.empty() ? ", in fact none" : ", but " + known));
  }
  return Body{};
}

namespace
{

/* Finds the run of a TS, and this body in it */
PetscErrorCode Find(TS ts, PetscInt scene, PetscInt extension, const Runtime **R, const FullExtension **x)
{
  PetscFunctionBegin;
  *R = RunOf(ts);
  PetscCheck(*R && extension >= 0 && (*R)->scene.number == scene, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_WRONG,
             "the TS is not of the scene that this body was added to: take one that its createTS() made");
  *x = static_cast<const FullExtension *>((*R)->scene.extensions[extension].get());
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode FullFeBody::positions(TS ts, PetscReal t, std::vector<double> *x) const
{
  Vec                  now, U = nullptr;
  PetscReal            present;
  const double        *u;
  const Runtime       *R;
  const FullExtension *e;
  PetscErrorCode (*read)(TS);
  PetscFunctionBegin;
  PetscCall(PetscObjectQueryFunction((PetscObject)ts, "TSHHT3ReadCheckpoint_C", &read)); /* reads a checkpoint that was to be read at set-up */
  if (read) PetscCall(read(ts));
  PetscCall(Find(ts, scene_, extension_, &R, &e));
  PetscCall(TSGetSolution(ts, &now));
  PetscCall(TSGetTime(ts, &present));
  if (t != present) { /* at the present time there may be no step to interpolate in: before the first one, in equilibrium, after a restart */
    PetscCall(VecDuplicate(now, &U));
    const PetscErrorCode failed = TSHHT3Interpolate(ts, t, U, nullptr, nullptr);
    if (failed) PetscCall(VecDestroy(&U));
    PetscCall(failed);
    now = U;
  }
  PetscCall(VecGetArrayRead(now, &u));
  const double *own = u + e->start[R->rank] - R->start;
  x->assign(own, own + e->coordinates());
  PetscCall(VecRestoreArrayRead(now, &u));
  PetscCall(VecDestroy(&U));
  PetscFunctionReturn(0);
}

PetscErrorCode FullFeBody::writeField(TS ts, PetscReal t, const std::string &file) const
{
  const Runtime       *R;
  const FullExtension *e;
  std::vector<double>  x;
  ReducedBody          b; /* the displacement as its only mode */
  PetscFunctionBegin;
  PetscCall(Find(ts, scene_, extension_, &R, &e));
  const FeModel &m = *e->model;
  PetscCall(positions(ts, t, &x));
  b.comm = m.comm;
  b.own = m.own;
  b.first = m.first;
  b.fe_nodes = m.nodes;
  b.label = m.label;
  b.elements = m.elements;
  b.coordinates.resize(x.size());
  b.shape.resize((PetscInt)x.size(), 1);
  for (PetscInt n = 0; n < m.own; n++) {
    const Vector3 p = e->placed(&m.coordinates[3 * n]);
    for (int c = 0; c < 3; c++) {
      b.coordinates[3 * n + c] = p(c);
      b.shape(3 * n + c, 0)    = x[3 * n + c] - p(c);
    }
  }
  b.modal.omega = Eigen::VectorXd::Ones(1);
  PetscCall(WriteField(b, Eigen::VectorXd::Ones(1), file));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
