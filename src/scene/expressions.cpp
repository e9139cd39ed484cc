/* User-defined variables and first-order states: their owners, the local arguments of their expressions, and checks. */
#include "expression_batch.h"
#include "kernels/marker_measure.h"
#include "runtime.h"
#include <cmath>

namespace hhtdae
{

namespace
{

/* Owner of a measure's first body or element; -1 if it has none */
PetscMPIInt OwnerOf(const Model &M, const Measure &m)
{
  const SceneData &s = M.scene;
  for (Marker k : {m.i, m.j, m.frame})
    if (s.valid(k) && s.markers[k.id].body >= 0) return M.number.owner[s.markers[k.id].body];
  if (m.kind == Measure::Modal) return M.number.owner[m.target];
  if (m.kind < Measure::Multiplier || m.kind > Measure::Component) return -1;
  const std::vector<Part> &parts = s.elements[m.target].parts;
  return parts.empty() ? -1 : OwnerOf(M, *parts[0].store, parts[0].index);
}

void AddRow(Localizer &l, ExpressionBatch &batch, ExpressionBatch::Kind kind, const char *what, const ExpressionData &d,
           PetscInt number)
{
  batch.add(kind, LocalFunction(l, std::string(what) + " " + d.name, &d.expression, 1), l.local(number),
            l.group(number, 1));
}

/* Whether an expression reads accelerations; the result is the same on every rank */
bool UsesAcceleration(const SceneData &s)
{
  if (!s.extensions.empty()) return true; /* their mass matrix couples coordinates of several ranks */
  for (const auto *list : {&s.variables, &s.states})
    for (const ExpressionData &d : *list)
      if (NeedsAcceleration(d.expression)) return true;
  for (const StoreBase *store : s.order)
    for (PetscInt e = 0; e < store->size(); e++)
      if (store->expressions(e))
        for (const Expression &f : *store->expressions(e))
          if (NeedsAcceleration(f)) return true;
  return false;
}

MarkerMotion<double> Described(const SceneData &s, Marker m)
{
  return {s.frame(m), s.twist(m), Vector3::Zero(), Vector3::Zero()};
}

bool DescribedValue(const SceneData &s, const Expression &e, double t, std::size_t depth, double *x);

/* Value of a measure at the described poses; false if it depends on anything but time, positions, velocities, states, and
   variables that depend only on these */
bool DescribedValue(const SceneData &s, const Measure &m, double t, std::size_t depth, double *x)
{
  if (m.kind == Measure::Time) *x = t;
  else if (m.kind == Measure::StateValue && m.target >= 0 && m.target < (PetscInt)s.states.size()) *x = s.states[m.target].initial;
  else if (m.kind == Measure::Value && m.target >= 0 && m.target < (PetscInt)s.variables.size()) return DescribedValue(s, s.variables[m.target].expression, t, depth + 1, x);
  else if (m.kind == Measure::Displacement || m.kind == Measure::Distance || m.kind == Measure::Angle || m.kind == Measure::Velocity || m.kind == Measure::Rate ||
           m.kind == Measure::AngularVelocity) {
    MarkerMotion<double> of[3];
    const Marker         marker[3] = {m.i, m.j, m.frame};
    for (int k = 0; k < 3; k++) {
      const bool any = marker[k].id != -1;
      if ((!any && k == 0) || (any && (!s.valid(marker[k]) || s.markers[marker[k].id].body < -1))) return false;
      if (any) of[k] = Described(s, marker[k]);
    }
    if (m.j.id == -1 && (m.kind == Measure::Angle || m.kind == Measure::Rate)) return false;
    *x = MarkerMeasure<double>(m.kind, m.component, 0, of[0], m.j.id == -1 ? nullptr : &of[1], m.frame.id == -1 ? nullptr : &of[2]);
  } else return false;
  return true;
}

bool DescribedValue(const SceneData &s, const Expression &e, double t, std::size_t depth, double *x)
{
  double m[Real::most];
  /* depth exceeds the number of variables if variables read each other in a cycle */
  if (depth > s.variables.size() || e.arguments.size() > Real::most || !e.f) return false;
  for (std::size_t k = 0; k < e.arguments.size(); k++)
    if (!DescribedValue(s, e.arguments[k], t, depth, m + k)) return false;
  *x = UserFunction("variable", e).value(m);
  return true;
}

} // namespace

double InitialInput(const SceneData &s, const ScalarRef &r, double t)
{
  double x;
  if (r.kind == ScalarRef::State && r.id >= 0) return s.states[r.id].initial;
  if (r.kind != ScalarRef::Variable || r.id < 0) return 0;
  const ExpressionData &v = s.variables[r.id];
  return !v.reached && DescribedValue(s, v.expression, t, 0, &x) ? x : v.initial;
}

PetscMPIInt OwnerOf(const Model &M, const Expression &e)
{
  if (M.size == 1) return 0;
  for (const Measure &m : e.arguments) {
    const PetscMPIInt owner = OwnerOf(M, m);
    if (owner >= 0) return owner;
  }
  return 0;
}

PetscErrorCode LocalizeExpressions(Runtime &R, Localizer &l)
{
  const SceneData &s = R.scene;
  PetscFunctionBegin;
  R.uses_acceleration = UsesAcceleration(s);
  auto batch          = std::make_unique<ExpressionBatch>(R.bodies);
  for (std::size_t i = 0; i < s.variables.size(); i++)
    if (R.number.variable_owner[i] == R.rank)
      AddRow(l, *batch, ExpressionBatch::Definition, "variable", s.variables[i], R.number.variable[i]);
  for (std::size_t i = 0; i < s.states.size(); i++)
    if (R.number.state_owner[i] == R.rank)
      AddRow(l, *batch, ExpressionBatch::RateOfState, "state", s.states[i], R.number.state[i]);
  if (!batch->empty()) R.batches.push_back(std::move(batch));
  PetscFunctionReturn(0);
}

/* ---- checks ---- */

namespace
{

bool Good(const SceneData &s, Marker m) { return s.valid(m) && s.markers[m.id].body >= -1; }

std::string CheckMarkers(const SceneData &s, const Measure &m)
{
  const bool pair = m.kind == Measure::Distance || m.kind == Measure::Rate || m.kind == Measure::Angle;
  if (!Good(s, m.i)) return "marker i is not one of this scene";
  if ((pair || m.j.id != -1) && !Good(s, m.j)) return "marker j is not one of this scene";
  if (m.frame.id != -1 && !Good(s, m.frame)) return "marker `frame` is not one of this scene";
  if (pair && m.i.id == m.j.id) return "markers i and j are the same";
  if (!pair && (m.component < 0 || m.component > 2))
    return "component is " + std::to_string(m.component) + ", must be 0, 1 or 2";
  const bool turns = m.kind == Measure::Angle || m.kind == Measure::AngularVelocity || m.kind == Measure::AngularAcceleration;
  for (Marker k : {m.i, m.j})
    if (turns && k.id != -1 && s.markers[k.id].body >= 0 && s.bodies[s.markers[k.id].body].forces_alone)
      return "a marker is on " + s.turnlessName(s.markers[k.id].body);
  if (m.kind != Measure::Angle) return "";
  if (std::abs(s.frame(m.i).R.col(0).dot(s.frame(m.j).R.col(2))) > 1 - 1e-8)
    return "the x axis of marker i is along the z axis of j, the angle about it is undefined";
  return "";
}

std::string CheckModal(const SceneData &s, const Measure &m)
{
  if (!s.valid(Body{m.target, m.scene}) || !s.bodies[m.target].flexible) return "its body is not a flexible one of this scene";
  const PetscInt n = s.bodies[m.target].flexible->model->modes();
  return m.component >= 0 && m.component < n ? "" : s.bodies[m.target].name + " has modes 0 to " + std::to_string(n - 1) + ", not " + std::to_string(m.component);
}

/* What is wrong with a measure of a load: its marker must be on a body on which the element acts */
std::string CheckLoad(const SceneData &s, const Measure &m)
{
  if (!s.valid(Element{m.target, m.scene})) return "its element is not one of this scene; add it first";
  if (m.component < 0 || m.component > 2) return "component is " + std::to_string(m.component) + ", must be 0, 1 or 2";
  if (!Good(s, m.i)) return "its marker is not one of this scene";
  if (m.frame.id != -1 && !Good(s, m.frame)) return "marker `frame` is not one of this scene";
  const ElementData &e = s.elements[m.target];
  return e.parts.empty() || s.loadedBody(e, s.markers[m.i.id].body) > -2 ? "" : std::string(e.type) + " " + e.name + " does not act on " + s.bodyName(s.markers[m.i.id].body);
}

std::string CheckElement(const SceneData &s, const Measure &m, bool in_equation)
{
  if (!s.valid(Element{m.target, m.scene}))
    return "its element is not one of this scene; add it first";
  const ElementData &e       = s.elements[m.target];
  const std::string  who     = std::string(e.type) + " " + e.name;
  const bool         of_load = m.kind == Measure::Component;
  if (e.parts.empty()) return ""; /* the element is absent or has errors that are reported separately */
  if (of_load != (e.kind == ElementData::Force))
    return who + (of_load ? " is not a force" : " is not a joint or motion");
  if (in_equation && e.parts[0].store->isExplicit()) return who + " is a function of the state without equations of its own, and its reaction for output alone";
  if (m.kind == Measure::JointForce || m.kind == Measure::JointMoment) {
    if (m.component < 0 || m.component > 2)
      return "component is " + std::to_string(m.component) + ", must be 0, 1 or 2";
    return m.frame.id != -1 && !Good(s, m.frame) ? "marker `frame` is not one of this scene" : "";
  }
  PetscInt rows = 0, row = m.component;
  for (const Part &p : e.parts) {
    if (p.store->isConstraint() == of_load) continue;
    if (in_equation && of_load && row >= 0 && row < p.store->rows() && !p.store->asForceStates(p.index))
      return who + " is eliminated; an expression needs its components as force states: set state = true on it";
    rows += p.store->rows();
    row -= p.store->rows();
  }
  if (m.component >= 0 && m.component < rows) return "";
  return who + " has " + (of_load ? "components" : "rows") + " 0 to " + std::to_string(rows - 1) + ", not " +
         std::to_string(m.component);
}

} // namespace

const char *NameOf(Measure::Kind k)
{
  constexpr const char *name[] = {"time",
                                  "displacement",
                                  "distance",
                                  "velocity",
                                  "rate",
                                  "acceleration",
                                  "angle",
                                  "angular velocity",
                                  "angular acceleration",
                                  "multiplier",
                                  "joint force",
                                  "joint moment",
                                  "force",
                                  "value of a variable",
                                  "value of a state",
                                  "modal coordinate",
                                  "force of an element",
                                  "moment of an element",
                                  "kinetic energy",
                                  "potential energy"};
  return name[k];
}

std::string CheckMeasure(const SceneData &s, const Measure &m, bool in_equation)
{
  switch (m.kind) {
  case Measure::Time:
    return "";
  case Measure::KineticEnergy:
  case Measure::PotentialEnergy:
    return in_equation ? "is for output alone" : "";
  case Measure::Value:
    return s.mine(m) && m.target >= 0 && m.target < (PetscInt)s.variables.size() ? "" : "not a variable of this scene";
  case Measure::StateValue:
    return s.mine(m) && m.target >= 0 && m.target < (PetscInt)s.states.size() ? "" : "not a state of this scene";
  case Measure::ElementForce:
  case Measure::ElementMoment:
    return in_equation ? "is for output alone; an expression takes jointForce() or a force state" : CheckLoad(s, m);
  case Measure::Modal:
    return CheckModal(s, m);
  case Measure::Multiplier:
  case Measure::JointForce:
  case Measure::JointMoment:
  case Measure::Component:
    return CheckElement(s, m, in_equation);
  default:
    return CheckMarkers(s, m);
  }
}

void CheckExpression(const SceneData &s, const std::string &who, const Expression &e, std::vector<std::string> &errors)
{
  if (!e.f) errors.push_back(who + ": its function is empty");
  if (e.arguments.size() > Real::most)
    errors.push_back(who + ": " + std::to_string(e.arguments.size()) + " arguments, at most " + std::to_string(Real::most) +
                     "; put parts of it into variables");
  for (std::size_t k = 0; k < e.arguments.size(); k++) {
    const std::string error = CheckMeasure(s, e.arguments[k], true);
    if (!error.empty())
      errors.push_back(who + ", argument " + std::to_string(k + 1) + " (" + NameOf(e.arguments[k].kind) +
                       "): " + error);
  }
}

void CheckExpressions(const SceneData &s, std::vector<std::string> &errors)
{
  for (const ExpressionData &d : s.variables) CheckExpression(s, "variable " + d.name, d.expression, errors);
  for (const ExpressionData &d : s.states) CheckExpression(s, "state " + d.name, d.expression, errors);
  for (const auto *list : {&s.variables, &s.states})
    for (const ExpressionData &d : *list)
      if (!std::isfinite(d.initial))
        errors.push_back((list == &s.variables ? "variable " : "state ") + d.name +
                         ": its initial value is not finite");
  for (const StoreBase *store : s.order)
    for (PetscInt e = 0; e < store->size(); e++) {
      if (!store->expressions(e)) continue;
      const ElementData &element = s.elements[store->element(e)];
      const auto        &list    = *store->expressions(e);
      for (std::size_t c = 0; c < list.size(); c++)
        CheckExpression(s, std::string(element.type) + " " + element.name + ", component " + std::to_string(c), list[c],
                        errors);
    }
}

} // namespace hhtdae
