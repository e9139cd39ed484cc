/* Sets up this rank's part of a run: bodies, markers, batches of elements, sparsity pattern of own rows, exchange with other ranks. */
#include "attach.h"
#include "extension.h"
#include "runtime.h"
#include <algorithm>
#include <unordered_map>

namespace hhtdae
{

namespace
{

PetscMPIInt OwnerOfBody(const Runtime &R, PetscInt b) { return R.number.owner.empty() ? 0 : R.number.owner[b]; }

class LocalizerOf : public Localizer
{
public:
  /* Collect: find the needed bodies and unknowns of other ranks. Place: assign local numbers. Read: after Layout(), for
     probes, which have no blocks of the matrix */
  enum Pass { Collect, Place, Read };
  LocalizerOf(Runtime &r, Pass pass) : R(r), pass_(pass), collecting_(pass == Collect), marker_(r.scene.markers.size(), -1)
  {
    bodies = &r.bodies;
    run    = &r;
  }

  bool needed(const StoreBase &s, PetscInt e) const override
  {
    if (R.size == 1 || OwnerOf(*R.model, s, e) == R.rank) return true;
    for (int k = 0; k < s.markers(); k++) {
      const PetscInt b = R.scene.markers[s.marker(e, k)].body;
      if (b >= 0 && OwnerOfBody(R, b) == R.rank) return true;
    }
    return false;
  }

  PetscInt marker(PetscInt id) override
  {
    const MarkerData &m = R.scene.markers[id];
    if (collecting_) {
      if (m.body >= 0 && OwnerOfBody(R, m.body) != R.rank) {
        other_bodies.push_back(m.body);
        if (R.scene.bodies[m.body].carrier >= 0) other_bodies.push_back(R.scene.bodies[m.body].carrier);
      }
      return 0;
    }
    if (marker_[id] < 0) {
      marker_[id] = (PetscInt)R.bodies.marker.size();
      R.bodies.marker.push_back({m.body < 0 ? (PetscInt)R.bodies.body.size() - 1 : R.local_body[m.body], m.s, m.R});
    }
    return marker_[id];
  }

  PetscInt group(PetscInt global, PetscInt size) override
  {
    if (pass_ == Read) return -1;
    const bool own = global >= R.start && global < R.start + R.n;
    if (collecting_) {
      for (PetscInt i = 0; i < size && !own; i++) others.push_back(global + i);
      return 0;
    }
    const auto found = group_.find(global);
    if (found != group_.end()) return found->second;
    return group_[global] = R.pattern.addGroup(global, local(global), size, own);
  }

  PetscInt local(PetscInt global) const override
  {
    if (global >= R.start && global < R.start + R.n) return global - R.start;
    if (collecting_) return 0;
    return R.n + (PetscInt)(std::lower_bound(R.others.begin(), R.others.end(), global) - R.others.begin());
  }

  Input input(const ScalarRef &r) override
  {
    if (r.id < 0) return {}; /* no unknown */
    switch (r.kind) {
    case ScalarRef::Variable:
      return place(R.number.variable[r.id], 1, 0);
    case ScalarRef::State:
      return place(R.number.state[r.id], 1, 0);
    case ScalarRef::Modal:
      return modal(r);
    default:
      break;
    }
    PetscInt row = r.component;
    for (const Part &p : R.scene.elements[r.id].parts) {
      if (p.store->isConstraint() != (r.kind == ScalarRef::Multiplier)) continue;
      if (row >= p.store->rows()) {
        row -= p.store->rows();
        continue;
      }
      PetscInt offset = row;
      if (p.store->isConstraint()) {
        const unsigned char active = p.store->active(p.index);
        if (!(active >> row & 1)) return {}; /* the multiplier of a dropped row is zero */
        offset = 0;
        for (PetscInt i = 0; i < row; i++) offset += active >> i & 1;
      }
      return place(p.store->start[p.index], p.store->unknowns(p.index), offset);
    }
    return {};
  }

  std::vector<PetscInt> other_bodies, others; /* results of Collect: bodies and unknowns of other ranks */

private:
  /* A modal coordinate as an input. It belongs to the third group of its body, which MakeBody() has added */
  Input modal(const ScalarRef &r)
  {
    if (collecting_) {
      if (OwnerOfBody(R, r.id) != R.rank) other_bodies.push_back(r.id);
      return {};
    }
    const LocalBody &b = R.bodies.body[R.local_body[r.id]];
    return {b.first + 6 + r.component, b.group + 2, r.component};
  }
  Input place(PetscInt global, PetscInt size, PetscInt offset)
  {
    const PetscInt g = group(global, size);
    return {local(global + offset), g, offset};
  }

  Runtime                               &R;
  Pass                                   pass_;
  bool                                   collecting_;
  std::vector<PetscInt>                  marker_;
  std::unordered_map<PetscInt, PetscInt> group_;
};

PetscErrorCode Localize(Runtime &R, Localizer &l)
{
  PetscFunctionBegin;
  R.batches.clear();
  for (const StoreBase *s : R.scene.order) s->localize(l, R.batches);
  for (auto &x : R.scene.extensions) x->localize(l, R.batches);
  PetscCall(LocalizeExpressions(R, l));
  PetscCall(LocalizeChannels(R, l));
  PetscCall(LocalizeDropped(R, l));
  PetscFunctionReturn(0);
}

LocalBody MakeBody(Runtime &R, PetscInt id, bool own)
{
  const BodyData &b = R.scene.bodies[id];
  LocalBody       k;
  k.kind  = b.carrier >= 0 ? BodyKind::Attached : KindOf(R.scene, b);
  k.owned = own;
  k.id    = id;
  k.mass  = b.mass;
  k.C.setIdentity();
  k.J = b.inertia;
  k.group = (PetscInt)R.pattern.group.size();
  if (k.kind == BodyKind::Attached) { /* a frame has no unknowns, only groups of columns for projection.h */
    for (int g = 0; g < frame_groups; g++) R.pattern.addFrameGroup((PetscInt)R.bodies.body.size(), 3 * g);
    return k;
  }
  const PetscInt global = R.number.body[id];
  k.first = own ? global - R.start : R.n + (PetscInt)(std::lower_bound(R.others.begin(), R.others.end(), global) - R.others.begin());
  for (int g = 0; g < Groups(k.kind); g++) {
    const int at = GroupOffset(k.kind, g);
    R.pattern.addGroup(global + at, k.first + at, GroupSize(k.kind, g), own);
  }
  if (k.kind == BodyKind::Flexible) {
    const int m = (int)b.flexible->model->modes();
    k.modal = (PetscInt)R.bodies.modal.size();
    R.pattern.addGroup(global + 6, k.first + 6, m, own);
    R.bodies.modal.emplace_back();
    ModalPart &p = R.bodies.modal.back();
    p.dynamics   = std::make_unique<ModalDynamics>(b.flexible->model, b.flexible->mass, ModalDamping(*b.flexible));
    p.load       = Eigen::VectorXd::Zero(m);
    if (own) p.block.resize(6 + m, std::max(6 + m, 1));
  }
  return k;
}

/* Makes a Carrier for every flexible body with attachments on this rank. If the frame of an attachment is on this rank, its body is, too */
void MakeCarriers(Runtime &R)
{
  Bodies               &B = R.bodies;
  std::vector<PetscInt> of(B.body.size(), -1);
  B.carriers.clear();
  for (std::size_t i = 0; i < B.body.size(); i++) {
    LocalBody &k = B.body[i];
    if (k.kind != BodyKind::Attached) continue;
    const BodyData        &frame = R.scene.bodies[k.id], &flexible = R.scene.bodies[frame.carrier];
    const ModalAttachment &a     = flexible.flexible->place(frame.attachment);
    const PetscInt         body  = R.local_body[frame.carrier];
    if (of[body] < 0) {
      of[body] = (PetscInt)B.carriers.size();
      B.carriers.emplace_back();
      B.carriers.back().body = body;
    }
    Carrier          &c = B.carriers[of[body]];
    Carrier::Attached f;
    f.body       = (PetscInt)i;
    f.attachment = &a;
    f.s          = a.position - flexible.center;
    k.carrier    = of[body];
    k.place      = c.count();
    c.attached.push_back(f);
  }
  for (Carrier &c : B.carriers) c.finish(B.modes(c.body));
}

/* Makes the local bodies: own ones in the order of their numbers, those of other ranks, the ground */
void MakeBodies(Runtime &R, const std::vector<PetscInt> &other)
{
  Bodies &B = R.bodies;
  B.body.clear();
  B.marker.clear();
  B.modal.clear();
  R.local_body.assign(R.scene.bodies.size(), -1);
  for (PetscInt id = 0; id < (PetscInt)R.scene.bodies.size(); id++)
    if (OwnerOfBody(R, id) == R.rank) {
      R.local_body[id] = (PetscInt)B.body.size();
      B.body.push_back(MakeBody(R, id, true));
    }
  B.own = (PetscInt)B.body.size();
  for (PetscInt id : other) {
    R.local_body[id] = (PetscInt)B.body.size();
    B.body.push_back(MakeBody(R, id, false));
  }
  B.body.push_back(LocalBody());
  BodyMotion still;
  still.r.setZero();
  still.v.setZero();
  still.w.setZero();
  still.A.setIdentity();
  still.G.setZero();
  still.f.setZero();
  still.m.setZero();
  B.now.assign(B.body.size(), still);
  MakeCarriers(R);
  B.gravity = R.scene.gravity;
  B.local   = R.scene.start.rotations == Rotations::Local;
}

void SortUnique(std::vector<PetscInt> &x)
{
  std::sort(x.begin(), x.end());
  x.erase(std::unique(x.begin(), x.end()), x.end());
}

/* Creates the PetscSF of the exchange: its leaves are the other ranks' unknowns on this rank; `boundary` lists own
   unknowns (roots) with leaves on other ranks */
PetscErrorCode MakeExchange(Runtime &R)
{
  const PetscInt  n = (PetscInt)R.others.size();
  const PetscInt *degree;
  PetscLayout     layout;
  PetscFunctionBegin;
  PetscCall(PetscLayoutCreateFromSizes(R.scene.comm, R.n, R.number.first.back(), 1, &layout));
  PetscCall(PetscSFCreate(R.scene.comm, &R.sf));
  PetscCall(PetscSFSetGraphLayout(R.sf, layout, n, nullptr, PETSC_COPY_VALUES, R.others.data()));
  PetscCall(PetscLayoutDestroy(&layout));
  PetscCall(PetscSFComputeDegreeBegin(R.sf, &degree));
  PetscCall(PetscSFComputeDegreeEnd(R.sf, &degree));
  R.boundary.clear();
  for (PetscInt i = 0; i < R.n; i++)
    if (degree[i]) R.boundary.push_back(i);
  const int width = R.uses_acceleration ? 3 : 2;
  PetscCallMPI(MPI_Type_contiguous(width, MPI_DOUBLE, &R.unit));
  PetscCallMPI(MPI_Type_commit(&R.unit));
  R.send.assign((std::size_t)width * R.n, 0);
  R.receive.assign((std::size_t)width * n, 0);
  R.u.assign(R.n + n, 0);
  R.v.assign(R.n + n, 0);
  R.a.assign(R.n + n, 0);
  PetscFunctionReturn(0);
}

/* Requests the diagonal blocks of the bodies first, so that the first slots belong to them */
PetscErrorCode MakePattern(Runtime &R)
{
  PetscInt bodies = 0;
  PetscFunctionBegin;
  for (PetscInt b = 0; b < R.bodies.own; b++) {
    const LocalBody &k = R.bodies.body[b];
    if (k.kind == BodyKind::Attached) continue;
    if (k.kind == BodyKind::Flexible) {
      for (int g = 0; g < 3; g++)
        for (int h = 0; h < 3; h++) bodies = 1 + R.pattern.need(k.group + g, k.group + h);
      continue;
    }
    for (int g = 0; g < Groups(k.kind); g++) bodies = 1 + R.pattern.need(k.group + g, k.group + g, g == 0);
  }
  for (auto &b : R.batches) b->pattern(R.pattern);
  R.projection.pattern(R.pattern, R.bodies);
  R.body_slot.resize(bodies);
  R.pattern.build(R.start, R.n);
  for (std::size_t i = 0; i < R.body_slot.size(); i++) R.body_slot[i] = R.pattern.slot((PetscInt)i);
  R.projection.resolve(R.pattern);
  for (auto &b : R.batches) b->resolve(R.pattern);
  PetscCall(R.pattern.createMat(R.scene.comm, R.n, &R.J));
  R.pattern.release();
  PetscFunctionReturn(0);
}

PetscErrorCode MakeRoles(Runtime &R)
{
  std::vector<PetscInt> role[TSHHT3_NUM_ROLES];
  const auto            add = [&](TSHHT3Role r, PetscInt global, PetscInt count) {
    for (PetscInt i = 0; i < count; i++) role[r].push_back(global + i);
  };
  PetscFunctionBegin;
  for (PetscInt b = 0; b < R.bodies.own; b++) {
    const LocalBody &k = R.bodies.body[b];
    if (k.kind != BodyKind::Attached) add(TSHHT3_COORDINATE, k.first + R.start, R.bodies.coordinates(b));
  }
  for (StoreBase *s : R.scene.order)
    for (PetscInt e = 0; e < s->size(); e++)
      if (s->unknowns(e) && OwnerOf(*R.model, *s, e) == R.rank)
        add(!s->isConstraint() ? TSHHT3_FORCE : s->isHolonomic() ? TSHHT3_HOLONOMIC : TSHHT3_NONHOLONOMIC, s->start[e], s->unknowns(e));
  for (std::size_t i = 0; i < R.number.variable.size(); i++)
    if (R.number.variable_owner[i] == R.rank) add(TSHHT3_VARIABLE, R.number.variable[i], 1);
  for (std::size_t i = 0; i < R.number.state.size(); i++)
    if (R.number.state_owner[i] == R.rank) add(TSHHT3_STATE, R.number.state[i], 1);
  for (auto &x : R.scene.extensions) {
    add(TSHHT3_COORDINATE, x->start[R.rank], x->coordinates());
    add(TSHHT3_HOLONOMIC, x->start[R.rank] + x->coordinates(), x->multipliers());
  }
  for (int r = 0; r < TSHHT3_NUM_ROLES; r++) {
    PetscCall(ISDestroy(&R.roles[r]));
    PetscCall(ISCreateGeneral(R.scene.comm, (PetscInt)role[r].size(), role[r].data(), PETSC_COPY_VALUES, &R.roles[r]));
  }
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode Layout(Runtime &R)
{
  PetscFunctionBegin;
  std::vector<PetscInt> other;
  R.pattern    = Pattern();
  R.projection = Projection();
  R.others.clear();
  if (R.size > 1) {
    LocalizerOf collect(R, LocalizerOf::Collect);
    PetscCall(Localize(R, collect));
    other = collect.other_bodies;
    SortUnique(other);
    R.others = collect.others;
    for (PetscInt b : other)
      for (int i = 0; i < CoordinatesOf(R.scene, R.scene.bodies[b]); i++) R.others.push_back(R.number.body[b] + i);
    SortUnique(R.others);
  }
  MakeBodies(R, other);
  LocalizerOf place(R, LocalizerOf::Place);
  PetscCall(Localize(R, place));
  if (R.size > 1) PetscCall(MakeExchange(R));
  PetscCall(MakePattern(R));
  PetscCall(MakeRoles(R));
  PetscCall(MakeAxes(R));
  PetscFunctionReturn(0);
}

/* The probe of a part of an element, with the present memories of the run; it is made at the first query */
Probe &ReaderOf(Runtime &R, const Part &p)
{
  std::unique_ptr<Probe> &reader = R.readers[{p.store, p.index}];
  if (!reader) {
    LocalizerOf read(R, LocalizerOf::Read);
    reader = p.store->probe(read, p.index);
  }
  std::vector<double> memory(reader->memory());
  RecallMemories(*reader, R.batches);
  for (const auto &b : R.batches)
    if (!memory.empty() && b->memoryOf(p.store, p.index, memory.data())) reader->copyMemory(memory.data(), true);
  return *reader;
}

PetscErrorCode RolesOf(const Runtime &R, std::vector<unsigned char> &role)
{
  PetscFunctionBegin;
  role.assign(R.n, TSHHT3_COORDINATE);
  for (int r = 0; r < TSHHT3_NUM_ROLES; r++) {
    if (!R.roles[r]) continue;
    const PetscInt *index;
    PetscInt        n;
    PetscCall(ISGetLocalSize(R.roles[r], &n));
    PetscCall(ISGetIndices(R.roles[r], &index));
    for (PetscInt k = 0; k < n; k++) role[index[k] - R.start] = (unsigned char)r;
    PetscCall(ISRestoreIndices(R.roles[r], &index));
  }
  PetscFunctionReturn(0);
}

} // namespace hhtdae
