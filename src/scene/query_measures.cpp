/* Values of measures in the state of a snapshot, on all ranks. */
#include "measures.h"
#include "output/energy.h"
#include "snapshot.h"

namespace hhtdae
{

/* Value of an unknown; zero for global = -1, a dropped multiplier */
PetscErrorCode Snapshot::Work::scalar(PetscMPIInt owner, PetscInt global, double *x)
{
  PetscFunctionBegin;
  *x = 0;
  if (global >= 0) PetscCall(FromOwner(*R, owner, x, 1, [&](double *y) { *y = u[global - R->start]; }));
  PetscFunctionReturn(0);
}

/* A multiplier, or a component of a force */
PetscErrorCode Snapshot::Work::component(const ElementData &e, PetscInt row, bool constraint, double *x)
{
  PetscFunctionBegin;
  *x = 0;
  for (const Part &p : e.parts) {
    if (p.store->isConstraint() != constraint) continue;
    if (row >= p.store->rows()) {
      row -= p.store->rows();
      continue;
    }
    const PetscMPIInt owner = OwnerOf(*R->model, *p.store, p.index);
    if (constraint && !p.store->isExplicit()) {
      const unsigned char active = p.store->active(p.index);
      PetscInt            place  = 0;
      for (PetscInt i = 0; i < row; i++) place += active >> i & 1;
      PetscCall(scalar(owner, active >> row & 1 ? p.store->start[p.index] + place : -1, x));
    } else if (p.store->asForceStates(p.index)) {
      PetscCall(scalar(owner, p.store->start[p.index] + row, x));
    } else {
      PetscCall(FromOwner(*R, owner, x, 1, [&](double *y) {
        std::vector<double> c(p.store->rows());
        move();
        const CountFrom then(*R, origin);
        ReaderOf(*R, p).components(at(), c.data());
        *y = c[row];
      }));
    }
    break;
  }
  PetscFunctionReturn(0);
}

PetscErrorCode Snapshot::Work::ofMarkers(const Measure &m, double *x)
{
  Motion i, j, frame;
  PetscFunctionBegin;
  PetscCall(motion(m.i.id, &i));
  if (m.j.id != -1) PetscCall(motion(m.j.id, &j));
  if (m.frame.id != -1) PetscCall(motion(m.frame.id, &frame));
  const Vector3 d = i.position - j.position, v = i.velocity - j.velocity, axis = frame.axes.col(std::clamp(m.component, 0, 2));
  switch (m.kind) {
  case Measure::Displacement: *x = axis.dot(d); break;
  case Measure::Distance: *x = d.norm(); break;
  case Measure::Velocity: *x = axis.dot(v); break;
  case Measure::Rate:
    *x = d.norm() > 0 ? d.dot(v) / d.norm() : 0;
    break;
  case Measure::Acceleration: *x = axis.dot(i.acceleration - j.acceleration); break;
  case Measure::AngularVelocity: *x = axis.dot(i.angular_velocity - j.angular_velocity); break;
  case Measure::AngularAcceleration: *x = axis.dot(i.angular_acceleration - j.angular_acceleration); break;
  default: *x = 0;
  }
  PetscFunctionReturn(0);
}

/* Once after a checkpoint was read */
static PetscErrorCode TellOfUnknownTurns(Runtime &R, PetscInt i, PetscInt j)
{
  PetscFunctionBegin;
  if (!R.turns_unknown) PetscFunctionReturn(0);
  R.turns_unknown = false;
  PetscCall(PetscPrintf(R.scene.comm,
                        "scene: before the checkpoint nobody has counted the full turns of the angle between %s and %s: it is now in (-pi, pi], and counted from here on. "
                        "Make a channel of it in both runs\n",
                        R.scene.bodyName(R.scene.markers[i].body).c_str(), R.scene.bodyName(R.scene.markers[j].body).c_str()));
  PetscFunctionReturn(0);
}

/* The run counts the full turns of an angle from the first query of the angle on */
PetscErrorCode Snapshot::Work::angle(PetscInt i, PetscInt j, double *x)
{
  const auto                same = [&](const CountedAngle &c) { return c.i == i && c.j == j; };
  const auto                mine = std::find_if(origin.counted.begin(), origin.counted.end(), same);
  std::vector<CountedAngle> now(1);
  bool                      turns_known;
  PetscFunctionBegin;
  PetscCall(hasBody(scene().markers[i].body));
  PetscCall(hasBody(scene().markers[j].body));
  move();
  if (mine != origin.counted.end()) {
    now[0] = *mine;
  } else {
    const CountFrom then(*R, origin);
    PetscCall(FirstAngle(*R, u.data(), t, i, j, &now[0], &turns_known));
    const bool here = origin.accepted_states == R->accepted_states; /* false if the run has made steps, or was moved to a checkpoint, since the state was stored */
    if (here && !turns_known) PetscCall(TellOfUnknownTurns(*R, i, j));
    if (here && std::none_of(R->queried_angles.begin(), R->queried_angles.end(), same)) R->queried_angles.push_back(now[0]);
    origin.counted.push_back(now[0]);
  }
  PetscCall(CountAngles(*R, u.data(), now));
  *x = now[0].angle;
  PetscFunctionReturn(0);
}

PetscErrorCode Snapshot::value(const Measure &m, double *x)
{
  Work              &w = *work_;
  Load               l;
  double             other;
  std::vector<double> eta;
  PetscFunctionBegin;
  CHECK_TAKEN(w);
  const SceneData  &s     = w.scene();
  const Numbering  &N     = w.R->number;
  const std::string error = CheckMeasure(s, m, false);
  PetscCheck(error.empty(), s.comm, PETSC_ERR_ARG_WRONG, "Snapshot::value(): %s", error.c_str());
  const bool of_element = (m.kind >= Measure::Multiplier && m.kind <= Measure::Component) || m.kind == Measure::ElementForce || m.kind == Measure::ElementMoment;
  *x                    = 0;
  if (of_element) PetscCall(w.hasElement(m.target));
  if (m.kind == Measure::Value || m.kind == Measure::StateValue)
    PetscCheck(m.target < (PetscInt)(m.kind == Measure::Value ? N.variable : N.state).size(), s.comm, PETSC_ERR_ARG_WRONGSTATE,
               "Snapshot::value(): the %s came too late: the scene is fixed from its set-up or first run on", m.kind == Measure::Value ? "variable" : "state");
  if (of_element && s.elements[m.target].parts.empty()) PetscFunctionReturn(0); /* an element without parts: zero */
  switch (m.kind) {
  case Measure::Time: *x = w.t; break;
  case Measure::KineticEnergy: PetscCall(energy(x, &other)); break;
  case Measure::PotentialEnergy: PetscCall(energy(&other, x)); break;
  case Measure::Value: PetscCall(w.scalar(N.variable_owner[m.target], N.variable[m.target], x)); break;
  case Measure::StateValue: PetscCall(w.scalar(N.state_owner[m.target], N.state[m.target], x)); break;
  case Measure::Modal:
    PetscCall(modes(Body{m.target}, &eta));
    *x = eta[m.component];
    break;
  case Measure::Multiplier: PetscCall(w.component(s.elements[m.target], m.component, true, x)); break;
  case Measure::Component: PetscCall(w.component(s.elements[m.target], m.component, false, x)); break;
  case Measure::JointForce:
  case Measure::JointMoment:
    PetscCall(load(Element{m.target}, s.elements[m.target].i, &l, m.frame.id != -1 ? m.frame : s.elements[m.target].j));
    *x = m.kind == Measure::JointForce ? l.force(m.component) : l.moment(m.component);
    break;
  case Measure::ElementForce:
  case Measure::ElementMoment:
    PetscCall(load(Element{m.target}, m.i, &l, m.frame));
    *x = m.kind == Measure::ElementForce ? l.force(m.component) : l.moment(m.component);
    break;
  case Measure::Angle: PetscCall(w.angle(m.i.id, m.j.id, x)); break;
  default: PetscCall(w.ofMarkers(m, x));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode Snapshot::energy(double *kinetic, double *potential)
{
  Work   &w = *work_;
  Balance b;
  PetscFunctionBegin;
  CHECK_TAKEN(w);
  w.move();
  const CountFrom then(*w.R, w.origin);
  PetscCall(MakeBalance(*w.R, w.at(), b));
  *kinetic   = b.kinetic;
  *potential = b.potential();
  PetscFunctionReturn(0);
}

} // namespace hhtdae
