/*
  Writes and reads the last entries of the checkpoint vector of a scene (Runtime::axes), which are the same on every rank:
  values of parameters, a digest of the description, and the state of the recorder, so that a resumed run continues the same
  output files. Beside the vector checkpoints have numbers whose count changes during the run: queried angles, Runtime::notes.
  Also compares the descriptions of different ranks by digests.
*/
#include "runtime.h"
#include "start.h"
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

namespace hhtdae
{

namespace
{

static_assert(checkpoint_numbers >= recorder_numbers + 3, "room for the digest, the recording, and whether parameters have changed");

/* FNV-1a hash. Numbers are rounded to single precision first, since machines and compilers differ in the last bits */
class Digest
{
public:
  void text(const std::string &x)
  {
    bytes(x.data(), x.size());
    integer((long)x.size());
  }
  void integer(long x) { bytes(&x, sizeof x); }
  void number(double x)
  {
    const float f = std::abs(x) < 1e-30 ? 0.f : (float)x;
    bytes(&f, sizeof f);
  }
  template <class M> void numbers(const M &m)
  {
    for (Eigen::Index i = 0; i < m.size(); i++) number(m.data()[i]);
  }
  /* Writes the hash as two integers that doubles represent exactly */
  void put(double x[2]) const
  {
    x[0] = (double)(sum_ >> 32);
    x[1] = (double)(sum_ & 0xffffffffu);
  }

private:
  std::uint64_t sum_ = 14695981039346656037ull;
  void          bytes(const void *x, std::size_t n)
  {
    for (std::size_t i = 0; i < n; i++) sum_ = (sum_ ^ static_cast<const unsigned char *>(x)[i]) * 1099511628211ull;
  }
};

void AddToDigest(Digest &d, const BodyData &b)
{
  d.integer(b.point + 2 * b.massless + 4 * (b.flexible != nullptr));
  d.integer(b.carrier);
  d.integer(b.attachment);
  d.number(b.mass);
  if (!b.point) d.numbers(b.inertia);
  d.numbers(b.center);
  if (!b.flexible) return;
  d.integer(b.flexible->model->modes());
  for (const double x : b.flexible->damping) d.number(x);
}

void AddToDigest(Digest &d, const MarkerData &m)
{
  d.integer(m.body);
  d.numbers(m.s);
  d.numbers(m.R);
}

void AddToDigest(Digest &d, const StoreBase &s)
{
  d.integer(s.isConstraint());
  for (PetscInt e = 0; e < s.size(); e++) {
    d.integer(s.element(e));
    d.integer(s.active(e) + 256 * s.asForceStates(e));
    for (int k = 0; k < s.markers(); k++) d.integer(s.marker(e, k));
    for (int i = 0; i < s.inputs(); i++) {
      const ScalarRef r = s.input(e, i);
      d.integer(r.kind + 8 * r.component);
      d.integer(r.id);
    }
  }
}

/* Digest of bodies, markers and the structure of elements. Stiffnesses and users' functions are not included, since a
   resumed run may have other ones */
Digest MakeDigest(const SceneData &s)
{
  Digest d;
  d.integer(s.planar + 2 * (int)s.start.rotations);
  d.numbers(s.gravity);
  d.integer((long)s.ground_acceleration.size());
  for (const BodyData &b : s.bodies) AddToDigest(d, b);
  for (std::size_t k = 0; k < s.ownMarkers(); k++) AddToDigest(d, s.markers[k]);
  for (const ElementData &e : s.elements) {
    d.text(e.type);
    d.integer(e.i.id);
    d.integer(e.j.id);
  }
  for (const StoreBase *store : s.order) AddToDigest(d, *store);
  for (const auto *unknowns : {&s.variables, &s.states}) d.integer((long)unknowns->size());
  return d;
}

/* Sections of a description that must be the same on all ranks: the digest of checkpoints, and further ones */
struct Section {
  const char *name;
  Digest      digest;
};

std::vector<Section> SectionsOf(const SceneData &s)
{
  std::vector<Section> all(6);
  all[0].name = "bodies, markers, gravity, elements and what they connect";
  all[0].digest = MakeDigest(s);
  all[0].digest.integer((long)s.errors.size());
  all[1].name = "positions and velocities of bodies at the start";
  for (const BodyData &b : s.bodies) {
    all[1].digest.numbers(b.r);
    all[1].digest.numbers(b.A);
    all[1].digest.numbers(b.v);
    all[1].digest.numbers(b.w);
  }
  all[2].name = "parameters";
  for (const ParameterData &p : s.parameters) {
    all[2].digest.text(p.name);
    all[2].digest.number(*p.present);
  }
  all[3].name = "names of bodies, elements, variables and states";
  for (const BodyData &b : s.bodies) all[3].digest.text(b.name);
  for (const ElementData &e : s.elements) all[3].digest.text(e.name);
  all[4].name = "channels";
  for (const ChannelData &c : s.channels) {
    all[4].digest.text(c.name);
    for (const Measure &m : c.value.arguments) all[4].digest.integer((long)m.kind);
  }
  all[5].name = "variables, states and how runs start";
  for (const auto *unknowns : {&s.variables, &s.states})
    for (const ExpressionData &x : *unknowns) {
      all[5].digest.text(x.name);
      all[5].digest.number(x.initial);
    }
  for (const double x : {s.start.tolerance, s.start.time, s.start.angle_tol, (double)s.start.assembly, (double)s.start.redundant, (double)s.start.equilibrium}) all[5].digest.number(x);
  return all;
}

/* A list such as "rank 1" or "ranks 1, 2, 5 and 7 more" */
std::string RankList(const std::vector<PetscMPIInt> &r)
{
  constexpr std::size_t max_named = 5;
  std::string           text = r.size() > 1 ? "ranks " : "rank ";
  for (std::size_t k = 0; k < std::min(max_named, r.size()); k++) text += (k ? ", " : "") + std::to_string(r[k]);
  return r.size() > max_named ? text + " and " + std::to_string(r.size() - max_named) + " more" : text;
}

/* Whether a value agrees with that of a checkpoint up to rounding */
bool AgreesWithCheckpoint(double a, double b) { return std::abs(a - b) <= 1e-12 * std::abs(a); }

PetscErrorCode CheckParameters(const SceneData &s, const double *x)
{
  PetscFunctionBegin;
  for (const ParameterData &p : s.parameters) {
    PetscCheck(AgreesWithCheckpoint(x[0], p.described), s.comm, PETSC_ERR_FILE_UNEXPECTED,
               "The checkpoint is of a run with parameter %s = %.15g, this one was made with %.15g: Scene::set() it before the run is made", p.name.c_str(), x[0], p.described);
    PetscCheck(AgreesWithCheckpoint(x[1], *p.present), s.comm, PETSC_ERR_FILE_UNEXPECTED,
               "When the checkpoint was written, parameter %s was %.15g, now it is %.15g: Scene::set() it before the checkpoint is read, and to another value after that", p.name.c_str(), x[1], *p.present);
    x += 2;
  }
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode CompareDescriptions(const SceneData &s, PetscMPIInt size)
{
  const std::vector<Section> sections = SectionsOf(s);
  const std::size_t          n        = 2 * sections.size();
  std::vector<double>        own(n), all(n * size);
  std::string                differences;
  PetscFunctionBegin;
  for (std::size_t k = 0; k < sections.size(); k++) sections[k].digest.put(&own[2 * k]);
  PetscCallMPI(MPI_Allgather(own.data(), (PetscMPIInt)n, MPI_DOUBLE, all.data(), (PetscMPIInt)n, MPI_DOUBLE, s.comm));
  for (std::size_t k = 0; k < sections.size(); k++) {
    std::vector<PetscMPIInt> others;
    for (PetscMPIInt r = 1; r < size; r++)
      if (all[n * r + 2 * k] != all[2 * k] || all[n * r + 2 * k + 1] != all[2 * k + 1]) others.push_back(r);
    if (!others.empty()) differences += std::string("\n  ") + sections[k].name + ": " + RankList(others);
  }
  PetscCheck(differences.empty(), s.comm, PETSC_ERR_ARG_NOTSAMETYPE,
             "ranks describe different scenes; on these ranks it is another one than on rank 0:%s\nEvery rank has to make the same calls in the same order, with the same numbers", differences.c_str());
  PetscFunctionReturn(0);
}

PetscErrorCode CheckSame(const Runtime &R, TS ts)
{
  constexpr int n = 4;
  PetscReal     x[n], least[2 * n];
  PetscFunctionBegin;
  if (R.size == 1) PetscFunctionReturn(0);
  PetscCall(TSGetTime(ts, &x[0]));
  PetscCall(TSGetMaxTime(ts, &x[1]));
  PetscCall(TSGetTolerances(ts, &x[2], nullptr, &x[3], nullptr));
  for (int k = 0; k < n; k++) {
    least[k]     = x[k];
    least[n + k] = -x[k];
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, least, 2 * n, MPIU_REAL, MPIU_MIN, R.scene.comm));
  const char *name[n] = {"time", "final time (TSSetMaxTime())", "absolute tolerance", "relative tolerance"};
  for (int k = 0; k < n; k++)
    PetscCheck(least[k] == -least[n + k], R.scene.comm, PETSC_ERR_ARG_NOTSAMETYPE, "Scene::solve(): the run's %s differs between ranks: from %g to %g", name[k], (double)least[k], (double)-least[n + k]);
  PetscFunctionReturn(0);
}

PetscInt Kept(const Runtime &R) { return 2 * (PetscInt)R.scene.parameters.size() + checkpoint_numbers; }

PetscErrorCode WriteKept(Runtime &R)
{
  double *x;
  PetscInt n;
  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(R.axes, &n));
  PetscCall(VecGetArray(R.axes, &x));
  double *end = x + n - Kept(R);
  for (const ParameterData &p : R.scene.parameters) {
    *end++ = p.described;
    *end++ = *p.present;
  }
  std::fill(end, end + checkpoint_numbers, 0.0);
  MakeDigest(R.scene).put(end);
  PetscCall(SaveOutput(R, end + 2));
  end[checkpoint_numbers - 1] = !R.step_parameters.empty() && R.step_parameters != ParametersNow(R.scene);
  PetscCall(VecRestoreArray(R.axes, &x));
  PetscFunctionReturn(0);
}

PetscErrorCode ReadKept(Runtime &R, const double *x)
{
  double digest[2];
  PetscFunctionBegin;
  PetscCall(CheckParameters(R.scene, x)); /* before the digest, since masses and positions may depend on parameters */
  x += Kept(R) - checkpoint_numbers;
  MakeDigest(R.scene).put(digest);
  PetscCheck(digest[0] == x[0] && digest[1] == x[1], R.scene.comm, PETSC_ERR_FILE_UNEXPECTED,
             "The checkpoint belongs to another scene: bodies, markers, gravity or the elements and what they connect are not the same");
  PetscCall(ResumeOutput(R, x + 2));
  R.step_parameters = R.start_parameters = ParametersNow(R.scene);
  if (x[checkpoint_numbers - 1] != 0) R.step_parameters.clear(); /* a parameter had been changed between the last step and the checkpoint */
  PetscFunctionReturn(0);
}

namespace
{

/* A queried angle in a checkpoint. The run that reads it may have other markers of these numbers, if they were made after the set-up. */
struct AngleNumbers {
  double i, j, angle, turned, markers[2]; /* markers: digest of both */
};

AngleNumbers NumbersOf(const SceneData &s, const CountedAngle &c)
{
  AngleNumbers x = {(double)c.i, (double)c.j, c.angle, c.turned, {0, 0}};
  Digest       d;
  for (PetscInt id : {c.i, c.j}) AddToDigest(d, s.markers[id]);
  d.put(x.markers);
  return x;
}

constexpr std::size_t angle_size = sizeof(AngleNumbers) / sizeof(double);

void WriteNumbers(const Runtime &R, std::vector<double> *x)
{
  x->push_back((double)R.queried_angles.size());
  for (const CountedAngle &c : R.queried_angles) {
    const AngleNumbers  n     = NumbersOf(R.scene, c);
    const double *const first = reinterpret_cast<const double *>(&n);
    x->insert(x->end(), first, first + angle_size);
  }
  x->insert(x->end(), R.notes.begin(), R.notes.end());
}

/* All that the run has counted itself belongs to another state */
void ReadNumbers(Runtime &R, const std::vector<double> &x)
{
  R.queried_angles.clear();
  R.accepted_states++;
  R.turns_unknown = true;
  const double *at = x.data() + 1;
  for (int k = 0; k < (int)x[0]; k++, at += angle_size) {
    AngleNumbers n;
    std::memcpy(&n, at, sizeof n);
    const CountedAngle c{(PetscInt)n.i, (PetscInt)n.j, n.angle, n.turned};
    if (std::max(c.i, c.j) >= (PetscInt)R.scene.markers.size()) continue;
    const AngleNumbers mine = NumbersOf(R.scene, c);
    if (std::equal(mine.markers, mine.markers + 2, n.markers)) R.queried_angles.push_back(c);
  }
  R.notes.assign(at, x.data() + x.size());
}

PetscErrorCode CheckpointNumbers(TS ts, PetscBool reading, std::vector<double> *x)
{
  PetscFunctionBegin;
  if (reading) ReadNumbers(*RunOf(ts), *x);
  else WriteNumbers(*RunOf(ts), x);
  PetscFunctionReturn(0);
}

PetscErrorCode Notes(TS ts, std::vector<double> **notes)
{
  PetscFunctionBegin;
  *notes = &RunOf(ts)->notes;
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode KeepNumbers(TS ts)
{
  PetscFunctionBegin;
  PetscCall(PetscObjectComposeFunction((PetscObject)ts, "TSHHT3CheckpointNumbers_C", CheckpointNumbers));
  PetscCall(PetscObjectComposeFunction((PetscObject)ts, "HHTSceneNotes_C", Notes));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
