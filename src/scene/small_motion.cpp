/* Small motions about the state of a linearization: derivatives of measures, right-hand sides of excitations, and the part of a body in a mode. */
#include "extension.h"
#include "linearization.h"
#include <algorithm>
#include <cmath>
#include <limits>

namespace hhtdae
{

/* Transforms x, x', x'' to the coordinates of the run. The equations contain no rates of multipliers, variables and force states, and no second rates of states: these are set to zero */
PetscErrorCode Linearization::Work::toState(const SmallMotion &x, Vec d[3]) const
{
  Vec in;
  PetscFunctionBegin;
  PetscCall(VecDuplicate(state[0], &in));
  for (int k = 0; k < 3; k++) PetscCall(VecSet(d[k], 0));
  for (int k = 0; k < 3; k++) {
    double          *y;
    PetscCall(VecGetArrayWrite(in, &y));
    std::copy(x[k].begin(), x[k].end(), y);
    for (PetscInt i = 0; i < R->n; i++)
      if (k && !coordinate(i) && !(k == 1 && role[i] == TSHHT3_STATE)) y[i] = 0;
    PetscCall(VecRestoreArrayWrite(in, &y));
    for (int order = k; order < 3; order++) {
      Vec product;
      PetscCall(VecDuplicate(in, &product));
      PetscCall(MatMult(turn[order][k], in, product));
      PetscCall(VecAXPY(d[order], 1, product));
      PetscCall(VecDestroy(&product));
    }
  }
  PetscCall(VecDestroy(&in));
  PetscFunctionReturn(0);
}

/* Differences of fourth order with decreasing steps until two agree. Most measures are nearly polynomial along a small
   motion, so that the first two agree. With a steep force, as in contacts, large steps leave the linear range; with small
   steps differences are rounding of the measure. If this rounding is large, for example of a pressure or of a reaction
   under preload, larger steps are tried as well (Linearize.MeasuresFarFromZero). largest: largest displacement of the
   whole motion, of which `along` is the real or imaginary part. */
PetscErrorCode Linearization::Work::derivative(const Measure &m, const SmallMotion &along, double largest, double *x) const
{
  constexpr double weight[2] = {8. / 12, -1. / 12}, agreement = 1e-9;
  Vec              d[3], at[3];
  double           reference, previous = INFINITY, best = INFINITY;
  PetscFunctionBegin;
  for (int c = 0; c < 3; c++) at[c] = state[c];
  PetscCall(setState(at));
  PetscCall(perturbed.value(m, &reference));
  for (int c = 0; c < 3; c++) {
    PetscCall(VecDuplicate(state[0], &d[c]));
    PetscCall(VecDuplicate(state[0], &at[c]));
  }
  PetscCall(toState(along, d));
  *x = 0;
  double     estimate = 0, rounding = 0;
  const auto attempt = [&](double reach) -> PetscErrorCode {
    const double e = reach * std::min(1., size) / (largest > 0 ? largest : 1);
    PetscFunctionBegin;
    estimate = 0;
    rounding = 4 * std::numeric_limits<double>::epsilon() * std::abs(reference) / e;
    for (int k = 1; k <= 2; k++)
      for (int side : {1, -1}) {
        double y;
        for (int c = 0; c < 3; c++) PetscCall(VecWAXPY(at[c], side * k * e, d[c], state[c]));
        PetscCall(setState(at));
        PetscCall(perturbed.value(m, &y));
        y -= reference;
        if (m.kind == Measure::Angle) y = std::remainder(y, 2 * M_PI); /* near half a turn the angle may change from pi to -pi */
        estimate += side * weight[k - 1] * y / e;
      }
    const double uncertainty = std::abs(estimate - previous) + rounding; /* infinite for the first step */
    if (uncertainty < best) {
      best = uncertainty;
      *x   = estimate;
    }
    previous = estimate;
    PetscFunctionReturn(0);
  };
  for (double reach : {1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9}) {
    PetscCall(attempt(reach));
    if (best <= agreement * std::abs(estimate) || 10 * rounding > best) break;
  }
  if (rounding > 0 && !(best <= 1e3 * agreement * std::abs(*x))) {
    previous = INFINITY;
    for (double reach : {1e-3, 1e-2, 1e-1, 1.}) {
      PetscCall(attempt(reach));
      if (best <= agreement * std::abs(estimate)) break;
    }
  }
  for (int c = 0; c < 3; c++) {
    PetscCall(VecDestroy(&d[c]));
    PetscCall(VecDestroy(&at[c]));
  }
  PetscFunctionReturn(0);
}

/* The largest displacement on all ranks */
PetscErrorCode Linearization::Work::displacement(const std::vector<std::complex<double>> &x, double *largest) const
{
  PetscFunctionBegin;
  *largest = 0;
  for (PetscInt i = 0; i < R->n; i++)
    if (coordinate(i)) *largest = std::max(*largest, std::abs(x[i]));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, largest, 1, MPI_DOUBLE, MPI_MAX, comm()));
  PetscFunctionReturn(0);
}

/* The row of a motion has its function minus the driven quantity; a motion of an acceleration is the rate of a state, in whose row the excitation acts */
PetscErrorCode Linearization::Work::motionLoad(Element e, std::vector<double> *b) const
{
  const SceneData &s = R->scene;
  PetscFunctionBegin;
  PetscCheck(s.valid(e) && s.elements[e.id].kind == ElementData::Motion && !s.elements[e.id].parts.empty(), comm(), PETSC_ERR_ARG_WRONG,
             "Linearization: the element of an excitation is not a motion of this scene");
  const Part    &p     = s.elements[e.id].parts[0];
  const bool     state = p.store->inputs() > 0;
  PetscCheck(state || p.store->unknowns(p.index), comm(), PETSC_ERR_ARG_WRONG, "Linearization: the motion %s was dropped as redundant and drives nothing", s.elements[e.id].name.c_str());
  const PetscInt row = state ? R->number.state[p.store->input(p.index, 0).id] : p.store->start[p.index];
  if (row >= R->start && row < R->start + R->n) (*b)[row - R->start] = state ? 1 : -1;
  PetscFunctionReturn(0);
}

/* b = -M x'' for the x'' of rigid translation with the ground, only in equations of motion: variables, states and force states read accelerations
   relative to the ground (Linearize.GroundAccelerationAndMeasuresOfAcceleration) */
PetscErrorCode Linearization::Work::groundLoad(const Vector3 &ground, std::vector<double> *b) const
{
  Vec           along, force;
  double       *x;
  const double *f;
  PetscFunctionBegin;
  PetscCheck(ground.allFinite(), comm(), PETSC_ERR_ARG_OUTOFRANGE, "Linearization: the acceleration of the ground is not a number");
  PetscCheck(!R->scene.planar || !ground.head<2>().isZero(0), comm(), PETSC_ERR_ARG_WRONG, "Linearization: the acceleration of the ground, (%g, %g, %g), moves nothing: the scene is planar", ground(0),
             ground(1), ground(2));
  PetscCall(MatCreateVecs(M, &along, &force));
  PetscCall(VecSet(along, 0));
  PetscCall(VecGetArray(along, &x));
  for (PetscInt k = 0; k < R->bodies.own; k++)
    for (int c = 0; Coordinates(R->bodies.body[k].kind) && c < GroupSize(R->bodies.body[k].kind, 0); c++) x[R->bodies.body[k].first + c] = ground(c);
  for (const auto &e : R->scene.extensions)
    for (PetscInt i = 0; e->vectors() && i < e->coordinates(); i++) x[e->start[R->rank] - R->start + i] = ground((int)(i % 3));
  PetscCall(VecRestoreArray(along, &x));
  PetscCall(MatMult(M, along, force));
  PetscCall(VecGetArrayRead(force, &f));
  for (PetscInt i = 0; i < R->n; i++)
    if (coordinate(i)) (*b)[i] = -f[i];
  PetscCall(VecRestoreArrayRead(force, &f));
  PetscCall(VecDestroy(&along));
  PetscCall(VecDestroy(&force));
  PetscFunctionReturn(0);
}

PetscErrorCode Linearization::Work::load(const Excitation &in, std::vector<double> *b) const
{
  PetscFunctionBegin;
  b->assign(R->n, 0);
  if (!in.ground.isZero(0)) {
    PetscCall(groundLoad(in.ground, b));
    PetscFunctionReturn(0);
  }
  if (in.driven.id >= 0) {
    PetscCall(motionLoad(in.driven, b));
    PetscFunctionReturn(0);
  }
  PetscCall(pointLoad(in, b));
  PetscFunctionReturn(0);
}

PetscErrorCode Linearization::Work::pointLoad(const Excitation &in, std::vector<double> *b) const
{
  const SceneData &s = R->scene;
  Motion           m, centre;
  PetscFunctionBegin;
  PetscCheck(s.valid(in.at), comm(), PETSC_ERR_ARG_WRONG, "Linearization: the marker of an excitation is not one of this scene");
  const PetscInt body = s.markers[in.at.id].body;
  PetscCheck(in.load.allFinite() && in.moment.allFinite(), comm(), PETSC_ERR_ARG_OUTOFRANGE, "Linearization: force or moment of an excitation is not a number");
  PetscCheck(body >= 0, comm(), PETSC_ERR_ARG_WRONG, "Linearization: the marker of an excitation is on the ground, which no load moves");
  /* force and moment are checked separately: one without effect is an error even if the other has one */
  const bool force_acts  = in.load.isZero(0) || !s.planar || !in.load.head<2>().isZero(0);
  const bool moment_acts = in.moment.isZero(0) || (!s.turnless(body) && (!s.planar || in.moment(2) != 0));
  PetscCheck(force_acts && moment_acts, comm(), PETSC_ERR_ARG_WRONG, "Linearization: %s of an excitation, (%g, %g, %g), moves nothing: the body %s %s", force_acts ? "the moment" : "the force",
             (force_acts ? in.moment : in.load)(0), (force_acts ? in.moment : in.load)(1), (force_acts ? in.moment : in.load)(2), s.bodies[body].name.c_str(),
             force_acts && s.turnless(body) ? "does not turn" : "stays in the plane");
  Vec at[3] = {state[0], state[1], state[2]};
  PetscCall(setState(at));
  PetscCall(perturbed.motion(in.at, &m));
  PetscCall(perturbed.motion(Body{body}, &centre));
  const PetscInt local = R->local_body[body];
  if (local < 0 || !R->bodies.body[local].owned) PetscFunctionReturn(0);
  const LocalBody &k        = R->bodies.body[local];
  const Vector3    moment   = in.moment + (m.position - centre.position).cross(in.load);
  const int        position = GroupSize(k.kind, 0);
  if (k.kind == BodyKind::Attached) { /* the load acts on the flexible body and its modes */
    const Carrier              &c = R->bodies.carriers[k.carrier];
    Eigen::Matrix<double, 6, 1> on;
    on << in.load, moment;
    const Eigen::VectorXd all = c.jacobian(R->bodies, (int)k.place).transpose() * on;
    std::copy(all.data(), all.data() + all.size(), b->data() + R->bodies.body[c.body].first);
    PetscFunctionReturn(0);
  }
  double *row = b->data() + k.first;
  for (int c = 0; c < position; c++) row[c] = in.load(c);
  if (k.kind == BodyKind::Planar) row[2] = moment(2);
  else if (TurnsInSpace(k.kind)) std::copy(moment.data(), moment.data() + 3, row + 3);
  PetscFunctionReturn(0);
}

PetscErrorCode AmplitudeOf(const Linearization::Work &w, const Measure &m, const std::vector<std::complex<double>> &x, std::complex<double> s, std::complex<double> *y)
{
  double part[2], largest;
  PetscFunctionBegin;
  /* largest displacement of real and imaginary part together: one of them may be nearly zero in coordinates but not in
     states */
  PetscCall(w.displacement(x, &largest));
  for (int imaginary = 0; imaginary < 2; imaginary++) {
    SmallMotion          along;
    std::complex<double> power = 1;
    for (int k = 0; k < 3; k++, power *= s) {
      along[k].resize(x.size());
      for (std::size_t i = 0; i < x.size(); i++) along[k][i] = imaginary ? (power * x[i]).imag() : (power * x[i]).real();
    }
    PetscCall(w.derivative(m, along, largest, &part[imaginary]));
  }
  *y = {part[0], part[1]};
  PetscFunctionReturn(0);
}

/* Divides by the entry of largest magnitude, which becomes 1; among equal ones by the first on the lowest rank */
PetscErrorCode Linearization::normalize(Mode *m) const
{
  const Work          &w    = *work_;
  std::complex<double> best = 0;
  PetscFunctionBegin;
  PetscCall(w.check("Linearization::normalize()", *m));
  for (PetscInt i = 0; i < w.R->n; i++)
    if (w.coordinate(i) && std::abs(m->shape[i]) > (1 + 1e-9) * std::abs(best)) best = m->shape[i];
  std::vector<std::complex<double>> all(w.R->size);
  PetscCallMPI(MPI_Allgather(&best, 2, MPI_DOUBLE, all.data(), 2, MPI_DOUBLE, w.comm()));
  best = 0;
  for (const auto &x : all)
    if (std::abs(x) > (1 + 1e-9) * std::abs(best)) best = x;
  if (std::abs(best) > 0)
    for (auto &x : m->shape) x /= best;
  PetscFunctionReturn(0);
}

PetscErrorCode Linearization::value(const Mode &m, const Measure &what, std::complex<double> *x) const
{
  PetscFunctionBegin;
  PetscCall(work_->check("Linearization::value()", m));
  PetscCall(AmplitudeOf(*work_, what, m.shape, m.value, x));
  PetscFunctionReturn(0);
}

PetscErrorCode Linearization::part(const Mode &m, Body b, BodyPart *part) const
{
  const Work    &w = *work_;
  const Runtime &R = *w.R;
  Vec            x, y;
  double         energy[2] = {0, 0}; /* kinetic energy of the body, and of all bodies */
  Vector3c       motion[2] = {Vector3c::Zero(), Vector3c::Zero()};
  PetscFunctionBegin;
  PetscCall(w.check("Linearization::part()", m));
  PetscCheck(R.scene.valid(b), w.comm(), PETSC_ERR_ARG_WRONG, "Linearization::part(): the body is not one of this scene");
  Motion at; /* also moves the bodies to the state, which c.jacobian() below needs */
  Vec    state[3] = {w.state[0], w.state[1], w.state[2]};
  PetscCall(w.setState(state));
  PetscCall(w.perturbed.motion(b, &at));
  const PetscInt local = R.local_body[b.id];
  const bool     mine  = local >= 0 && R.bodies.body[local].owned;
  const PetscInt first = mine ? R.bodies.body[local].first : 0, last = mine ? first + R.bodies.coordinates(local) : 0;
  PetscCall(MatCreateVecs(w.M, &x, &y));
  for (int imaginary = 0; imaginary < 2; imaginary++) {
    double       *put;
    const double *get;
    PetscCall(VecGetArrayWrite(x, &put));
    for (PetscInt i = 0; i < R.n; i++) put[i] = !w.coordinate(i) ? 0 : imaginary ? m.shape[i].imag() : m.shape[i].real();
    PetscCall(VecRestoreArrayWrite(x, &put));
    PetscCall(MatMult(w.M, x, y));
    PetscCall(VecGetArrayRead(y, &get));
    for (PetscInt i = 0; i < R.n; i++) {
      const double e = !w.coordinate(i) ? 0 : get[i] * (imaginary ? m.shape[i].imag() : m.shape[i].real());
      energy[1] += e;
      if (i >= first && i < last) energy[0] += e;
    }
    PetscCall(VecRestoreArrayRead(y, &get));
  }
  PetscCall(VecDestroy(&x));
  PetscCall(VecDestroy(&y));
  if (mine) {
    const BodyKind kind     = R.bodies.body[local].kind;
    const int      position = kind == BodyKind::Attached ? 0 : GroupSize(kind, 0), rotations = kind == BodyKind::Planar ? 1 : TurnsInSpace(kind) ? 3 : 0;
    for (int c = 0; c < position; c++) motion[0](c) = m.shape[first + c];
    for (int c = 0; c < rotations; c++) motion[1](rotations == 1 ? 2 : c) = m.shape[first + position + c];
  }
  if (mine && R.bodies.body[local].kind == BodyKind::Attached) { /* the motion of a frame follows from its flexible body and the modes */
    const LocalBody       &k    = R.bodies.body[local];
    const Carrier         &c    = R.bodies.carriers[k.carrier];
    const Eigen::MatrixXd  J    = c.jacobian(R.bodies, (int)k.place);
    const Eigen::VectorXcd frame_motion = J * Eigen::Map<const Eigen::VectorXcd>(m.shape.data() + R.bodies.body[c.body].first, J.cols());
    motion[0]                           = frame_motion.head<3>();
    motion[1]                           = frame_motion.tail<3>();
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, energy, 2, MPI_DOUBLE, MPI_SUM, w.comm()));
  for (Vector3c &x : motion) PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, x.data(), 6, MPI_DOUBLE, MPI_SUM, w.comm()));
  part->displacement = motion[0];
  part->rotation     = motion[1];
  part->share        = energy[1] != 0 ? energy[0] / energy[1] : 0;
  PetscFunctionReturn(0);
}

} // namespace hhtdae
