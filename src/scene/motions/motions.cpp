/* Motions: displacement, velocity or acceleration of marker i relative to j as a function of time. */
#include "scene/kernels/motion.h"
#include "scene/model.h"
#include "scene/motions/moving_pair.h"

namespace hhtdae
{

namespace
{

/* t: time of the start */
void CheckFunction(ElementBuilder &e, const TimeFunction &f, MotionOf of, double t)
{
  e.require(f.error().empty(), "its function: " + f.error());
  if (!e.good()) return;
  const std::string         when = " at the start, t = " + Show(t) + (t == 0 ? " (another time is set before by Scene::start())" : "");
  const TimeFunction::Value v    = f(t);
  e.require(std::isfinite(v.f), "its function is " + Show(v.f) + when + ", must be finite");
  if (of == MotionOf::Displacement)
    e.require(std::isfinite(v.f1) && std::isfinite(v.f2), "its function has derivatives " + Show(v.f1) + " and " + Show(v.f2) + when + ", a displacement needs them finite");
}

/* The expression f(t), the rate of a state */
Expression Rate(const TimeFunction &f)
{
  return {{Measure::time()}, [f](const Real *m) {
            const TimeFunction::Value v = f(m[0].value());
            return chain(m[0], v.f, v.f1);
          }};
}

/* Adds the constraint of a motion. speed: relative speed at the start, the initial value from which a prescribed acceleration is integrated */
template <class Displacement, class Velocity, class OfState, class Spec>
void Drive(Scene &scene, ElementBuilder &e, const std::string &name, const Spec &s, const MotionData &d, double speed)
{
  if (s.of == MotionOf::Displacement) e.constrain<Displacement>({s.i, s.j}, d);
  if (s.of == MotionOf::Velocity) e.constrain<Velocity>({s.i, s.j}, d);
  if (s.of == MotionOf::Acceleration) {
    /* Scene::state() is not used, since it would record the call, and the state would be added twice when the scene is
       described anew */
    std::vector<ExpressionData> &states = DataOf(scene).states;
    const PetscInt               w      = (PetscInt)states.size();
    states.push_back({name.empty() ? "state " + std::to_string(w) : name + " speed", Rate(s.function), speed});
    e.constrain<OfState>({s.i, s.j}, d, {ScalarRef{ScalarRef::State, w, 0}});
  }
}

} // namespace

template <> Element Scene::enter(const std::string &name, const RotationalMotion &s)
{
  ElementBuilder e(*this, name, "rotational motion", ElementData::Motion, s.i, s.j);
  CheckFunction(e, s.function, s.of, start().time);
  if (e.good()) RequirePair(e, s.i, s.j, true);
  if (e.good()) {
    const double speed = AngleRate<double>(e.frame(s.i), e.frame(s.j), data().twist(s.i), data().twist(s.j));
    Drive<DrivenAngle, DrivenAngularVelocity, StateAngularVelocity>(*this, e, name, s, {s.function, 2}, speed);
  }
  return e.done();
}

template <> Element Scene::enter(const std::string &name, const TranslationalMotion &s)
{
  ElementBuilder e(*this, name, "translational motion", ElementData::Motion, s.i, s.j);
  const int      axis = e.slidingAxis(s.axis);
  CheckFunction(e, s.function, s.of, start().time);
  e.require(s.axis >= 0 && s.axis < 3, "axis is " + std::to_string(s.axis) + ", must be 0, 1 or 2");
  if (e.good()) RequirePair(e, s.i, s.j, false);
  if (e.good()) {
    const double speed = AdvanceRate<double>(e.frame(s.i), e.frame(s.j), data().twist(s.i), data().twist(s.j), axis);
    Drive<DrivenAdvance, DrivenVelocity, StateVelocity>(*this, e, name, s, {s.function, axis}, speed);
  }
  return e.done();
}

} // namespace hhtdae
