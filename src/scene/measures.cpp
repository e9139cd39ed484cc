#include "measures.h"
#include "marker_motion.h"
#include "runtime.h"

namespace hhtdae
{

namespace
{

bool IsJoint(Measure::Kind k) { return k == Measure::JointForce || k == Measure::JointMoment; }
bool IsLoad(Measure::Kind k) { return k == Measure::ElementForce || k == Measure::ElementMoment; }
bool IsScalar(Measure::Kind k)
{
  return k == Measure::Multiplier || k == Measure::Component || k == Measure::Value || k == Measure::StateValue ||
         k == Measure::Modal;
}

bool Accelerates(Measure::Kind k) { return k == Measure::Acceleration || k == Measure::AngularAcceleration; }

/* ---- reactions of elements: f . axis, or (m + arm x f) . axis, summed over the element's markers on i's body ---- */

Vector3 AxisOf(const LocalMeasure &m, const Evaluation &e)
{
  return m.frame < 0 ? Vector3(Vector3::Unit(m.component)) : Vector3(e.bodies.frame(m.frame).R.col(m.component));
}

constexpr int max_reaction_markers = 6,
              max_reaction_rows    = 8; /* largest numbers of a constraint: couplers of three joints have 6 markers; StoreBase::active() has 8 bits */

bool OnBody(const Evaluation &e, const LocalMeasure &m, PetscInt marker)
{
  return e.bodies.marker[marker].body == e.bodies.marker[m.i].body;
}

/* The body of marker i; if that is an attachment on which the element does not act, its flexible body, on whose modes the element may act */
PetscInt LoadedBody(const LocalMeasure &m, const Evaluation &e)
{
  const PetscInt body = e.bodies.marker[m.i].body, carrier = e.bodies.body[body].carrier;
  if (carrier < 0) return body;
  for (const auto &p : m.probes)
    for (int k = 0; k < p->markers(); k++)
      if (OnBody(e, m, p->marker(k))) return body;
  return e.bodies.carriers[carrier].body;
}

/* Force by an element on i's body, or moment about i's origin */
Vector3 ReactionOf(const LocalMeasure &m, const Evaluation &e)
{
  const Vector3  x = e.bodies.frame(m.i).x;
  Wrench<double> on[max_reaction_markers];
  Vector3        sum  = Vector3::Zero();
  const PetscInt body = LoadedBody(m, e);
  for (const auto &p : m.probes) {
    p->loads(e, on);
    for (int k = 0; k < p->markers(); k++) {
      if (e.bodies.marker[p->marker(k)].body != body) continue;
      if (m.kind == Measure::JointForce || m.kind == Measure::ElementForce)
        sum += on[k].f;
      else
        sum += on[k].m + (e.bodies.frame(p->marker(k)).x - x).cross(on[k].f);
    }
  }
  return sum;
}

/* Transforms a gradient J by (x, theta) of a marker to its body's coordinates and adds it to the row */
void AddMarker(const Evaluation &e, PetscInt marker, const Matrix<1, 6> &J, int at, double *row)
{
  if (at < 0) return;
  Matrix<1, 6> by = Matrix<1, 6>::Zero();
  const int    n  = e.bodies.columns(marker, e.bodies.frame(marker), J, by);
  e.bodies.inStep(marker, by);
  for (int c = 0; c < n; c++) row[at + c] += by(c);
}

void AddJointGradient(const LocalMeasure &m, const Evaluation &e, double factor, const std::vector<int> &at,
                      double *row)
{
  const bool    force = m.kind == Measure::JointForce;
  const Vector3 axis = factor * AxisOf(m, e), x = e.bodies.frame(m.i).x;
  std::size_t   next = 3;
  for (const auto &p : m.probes) {
    Wrench<double>                      on[max_reaction_markers];
    Matrix<6 * max_reaction_markers, 1> y = Matrix<6 * max_reaction_markers, 1>::Zero(), by = y;
    double                              lambda[max_reaction_rows];
    p->reaction(e, on);
    for (int k = 0; k < p->markers(); k++) {
      if (!OnBody(e, m, p->marker(k))) continue;
      const Vector3 arm       = e.bodies.frame(p->marker(k)).x - x;
      y.segment<3>(6 * k)     = force ? axis : Vector3(axis.cross(arm));
      y.segment<3>(6 * k + 3) = force ? Vector3(Vector3::Zero()) : axis;
    }
    p->reactionGradient(e, y.data(), by.data(), lambda);
    for (int k = 0; k < p->markers(); k++) {
      Matrix<1, 6> J = by.segment<6>(6 * k).transpose();
      if (!force && OnBody(e, m, p->marker(k))) { /* the arm of the moment changes */
        const Vector3 turn = on[k].f.cross(axis);
        Matrix<1, 6>  back = Matrix<1, 6>::Zero();
        back.head<3>()     = -turn.transpose();
        J.head<3>() += turn.transpose();
        AddMarker(e, m.i, back, at[0], row);
      }
      AddMarker(e, p->marker(k), J, at[next++], row);
    }
    for (int r = 0; r < p->multipliers(); r++, next++)
      if (at[next] >= 0) row[at[next]] += lambda[r];
  }
  if (m.frame < 0) return;
  Matrix<1, 6> turn = Matrix<1, 6>::Zero();
  turn.tail<3>()    = axis.cross(ReactionOf(m, e)).transpose();
  AddMarker(e, m.frame, turn, at[2], row);
}

/* ---- placing ---- */

void PlaceJoint(Localizer &l, const Measure &m, LocalMeasure &k)
{
  const SceneData   &s = l.run->scene;
  const ElementData &e = s.elements[m.target];
  k.i                  = l.marker(e.i.id);
  const Marker axes    = s.valid(m.frame) ? m.frame : e.j;
  k.frame              = s.valid(axes) ? l.marker(axes.id) : -1;
  for (const Part &p : e.parts)
    if (p.store->isConstraint() && (p.store->isExplicit() || p.store->unknowns(p.index))) k.probes.push_back(p.store->probe(l, p.index));
}

void PlaceComponent(Localizer &l, const Measure &m, LocalMeasure &k)
{
  PetscInt    row  = m.component;
  const Part *part = FindPart(l.run->scene, m.target, false, row);
  if (part->store->asForceStates(part->index)) {
    k.input = l.input({ScalarRef::ForceState, m.target, m.component});
  } else {
    k.component = (int)row;
    k.probes.push_back(part->store->probe(l, part->index));
  }
}

void PlaceLoad(Localizer &l, const Measure &m, LocalMeasure &k)
{
  const SceneData &s = l.run->scene;
  k.i                = l.marker(m.i.id);
  k.frame            = s.valid(m.frame) ? l.marker(m.frame.id) : -1;
  for (const Part &p : s.elements[m.target].parts) k.probes.push_back(p.store->probe(l, p.index));
}

constexpr int max_force_components = 12; /* largest number of components of a force */

} // namespace

const Part *FindPart(const SceneData &s, PetscInt element, bool constraint, PetscInt &row)
{
  for (const Part &p : s.elements[element].parts) {
    if (p.store->isConstraint() != constraint) continue;
    if (row < p.store->rows()) return &p;
    row -= p.store->rows();
  }
  return nullptr;
}

bool NeedsAcceleration(const Measure &m) { return Accelerates(m.kind); }

bool FollowsFromEquations(const SceneData &s, const Measure &m)
{
  if (Accelerates(m.kind) || IsJoint(m.kind) || IsLoad(m.kind) || m.kind == Measure::Multiplier || m.kind == Measure::Value) return true;
  if (m.kind != Measure::Component) return false;
  PetscInt    row  = m.component;
  const Part *part = FindPart(s, m.target, false, row);
  if (!part) return false;
  const std::vector<Expression> *own = part->store->expressions(part->index);
  const auto follows = [&](const Measure &a) { return FollowsFromEquations(s, a); };
  return part->store->asForceStates(part->index) || part->store->inputs() > 0 ||
         (own && std::any_of(own->begin(), own->end(), [&](const Expression &f) {
            return std::any_of(f.arguments.begin(), f.arguments.end(), follows);
          }));
}

bool NeedsAcceleration(const Expression &f)
{
  for (const Measure &m : f.arguments)
    if (NeedsAcceleration(m)) return true;
  return false;
}

LocalMeasure PlaceMeasure(Localizer &l, const Measure &m)
{
  const SceneData &s = l.run->scene;
  LocalMeasure     k;
  k.kind      = m.kind;
  k.component = m.component;
  const bool of_element = IsJoint(m.kind) || IsLoad(m.kind) || m.kind == Measure::Multiplier || m.kind == Measure::Component;
  if (of_element && s.elements[m.target].parts.empty()) { /* measures of an element without parts are zero, as a dropped multiplier is */
    k.kind = Measure::Multiplier;
    return k;
  }
  switch (m.kind) {
  case Measure::Time:
  case Measure::KineticEnergy:
  case Measure::PotentialEnergy:
    break;
  case Measure::Multiplier:
    if (s.elements[m.target].parts[0].store->isExplicit()) k.probes.push_back(s.elements[m.target].parts[0].store->probe(l, s.elements[m.target].parts[0].index));
    else k.input = l.input({ScalarRef::Multiplier, m.target, m.component});
    break;
  case Measure::Value:
    k.input = l.input({ScalarRef::Variable, m.target, 0});
    break;
  case Measure::StateValue:
    k.input = l.input({ScalarRef::State, m.target, 0});
    break;
  case Measure::Modal:
    k.input = l.input({ScalarRef::Modal, m.target, m.component});
    break;
  case Measure::Component:
    PlaceComponent(l, m, k);
    break;
  case Measure::JointForce:
  case Measure::JointMoment:
    PlaceJoint(l, m, k);
    break;
  case Measure::ElementForce:
  case Measure::ElementMoment:
    PlaceLoad(l, m, k);
    break;
  default:
    k.i = l.marker(m.i.id);
    if (s.valid(m.j)) k.j = l.marker(m.j.id);
    if (s.valid(m.frame)) k.frame = l.marker(m.frame.id);
    if (m.kind != Measure::Angle) break;
    k.angle = StartAngle(*l.run->model, m.i, m.j);
    k.of[0] = m.i.id;
    k.of[1] = m.j.id;
  }
  return k;
}

double MeasureValue(const LocalMeasure &m, const Evaluation &e)
{
  if (m.kind == Measure::Time) return e.t;
  if (IsScalar(m.kind) && !m.probes.empty()) {
    double c[max_force_components];
    m.probes[0]->components(e, c);
    return c[m.component];
  }
  if (IsScalar(m.kind)) return e.input(m.input);
  if (IsJoint(m.kind) || IsLoad(m.kind)) return AxisOf(m, e).dot(ReactionOf(m, e));
  if (m.i < 0) return 0;
  const bool           a = Accelerates(m.kind);
  MarkerMotion<double> i = MotionOfMarker(e, m.i, a), j, frame;
  if (m.j >= 0) j = MotionOfMarker(e, m.j, a);
  if (m.frame >= 0) frame = MotionOfMarker(e, m.frame, false);
  return MarkerMeasure<double>(m.kind, m.component, m.angle, i, m.j < 0 ? nullptr : &j, m.frame < 0 ? nullptr : &frame);
}

void LocalMeasure::accept(const Bodies &B)
{
  if (kind == Measure::Angle) angle = UnwoundAngle<double>(B.frame(i), B.frame(j), angle);
  for (auto &p : probes) p->accept(B);
}

double LocalMeasure::longestStep(const Evaluation &e) const
{
  if (kind != Measure::Angle) return std::numeric_limits<double>::infinity();
  const MarkerMotion<double> a = MotionOfMarker(e, i, true), b = MotionOfMarker(e, j, true);
  return LongestTurn(AngleRate<double>(a.f, b.f, a.w, b.w), (a.alpha - b.alpha).norm());
}

PetscInt LocalMeasure::memory() const
{
  PetscInt n = kind == Measure::Angle;
  for (const auto &p : probes) n += p->memory();
  return n;
}

void LocalMeasure::copyMemory(double *x, bool in)
{
  if (kind == Measure::Angle) {
    if (in)
      angle = *x;
    else
      *x = angle;
    x++;
  }
  for (auto &p : probes) {
    p->copyMemory(x, in);
    x += p->memory();
  }
}

/* ---- columns and derivatives ---- */

int Columns::add(PetscInt group, int size)
{
  for (const Part &p : parts)
    if (p.group == group) return p.start;
  parts.push_back({group, size, width});
  width += size;
  return width - size;
}

int Columns::body(const Bodies &B, PetscInt b)
{
  const LocalBody &k = B.body[b];
  if (k.kind == BodyKind::Ground) return -1;
  const int start = add(k.group, GroupSize(k.kind, 0));
  for (int g = 1; g < (k.kind == BodyKind::Attached ? frame_groups : Groups(k.kind)); g++)
    add(k.group + g, GroupSize(k.kind, g)); /* the groups of a body are consecutive */
  return start;
}

int Columns::scalar(const Pattern &p, const Input &i)
{
  return i.group < 0 ? -1 : add(i.group, (int)p.group[i.group].size) + (int)i.offset;
}

void MeasureSet::connect(const Bodies &B, const Pattern &p)
{
  columns_ = Columns();
  at_.assign(all_.size(), {});
  for (std::size_t k = 0; k < all_.size(); k++) {
    const LocalMeasure &m = all_[k];
    if (m.kind == Measure::Time) continue;
    if (IsScalar(m.kind)) {
      at_[k].push_back(columns_.scalar(p, m.input));
      continue;
    }
    for (PetscInt marker : {m.i, m.j, m.frame})
      at_[k].push_back(marker < 0 ? -1 : columns_.body(B, B.marker[marker].body));
    for (const auto &q : m.probes) {
      for (int i = 0; i < q->markers(); i++) at_[k].push_back(columns_.body(B, B.marker[q->marker(i)].body));
      for (int r = 0; r < q->multipliers(); r++) at_[k].push_back(columns_.scalar(p, q->multiplier(r)));
    }
  }
}

void MeasureSet::addGradient(int k, const Evaluation &e, double factor, double *row) const
{
  const LocalMeasure     &m  = all_[k];
  const std::vector<int> &at = at_[k];
  if (m.kind == Measure::Time || factor == 0) return;
  if (IsScalar(m.kind)) {
    if (at[0] >= 0) row[at[0]] += factor;
    return;
  }
  if (IsJoint(m.kind)) {
    AddJointGradient(m, e, factor, at, row);
    return;
  }
  using T                   = MeasureDual;
  const PetscInt  marker[3] = {m.i, m.j, m.frame};
  MarkerMotion<T> motion[3];
  const auto      attached = [&](int i) { return marker[i] >= 0 && e.bodies.body[e.bodies.marker[marker[i]].body].kind == BodyKind::Attached; };
  const int       orders   = !attached(0) && !attached(1) && !attached(2) ? 1 : Accelerates(m.kind) ? 3 : 2;
  for (int order = 0; order < orders; order++) {
    for (int i = 0; i < 3; i++)
      if (marker[i] >= 0) motion[i] = MotionOfMarker(e, marker[i], i * max_coordinates, order);
    const T x = MarkerMeasure<T>(m.kind, m.component, m.angle, motion[0], m.j < 0 ? nullptr : &motion[1], m.frame < 0 ? nullptr : &motion[2]);
    for (int i = 0; i < 3; i++) {
      if (at[i] < 0 || (order && !attached(i))) continue;
      const int n = attached(i) ? max_coordinates : Coordinates(e.bodies.body[e.bodies.marker[marker[i]].body].kind);
      for (int c = 0; c < n; c++) row[at[i] + max_coordinates * order + c] += factor * x.derivatives()(i * max_coordinates + c);
    }
  }
}

void MeasureSet::accept(const Bodies &B)
{
  for (LocalMeasure &m : all_) m.accept(B);
}

PetscInt MeasureSet::memory() const
{
  PetscInt n = 0;
  for (const LocalMeasure &m : all_) n += m.memory();
  return n;
}

void MeasureSet::copyMemory(double *x, bool in)
{
  for (LocalMeasure &m : all_) {
    m.copyMemory(x, in);
    x += m.memory();
  }
}

} // namespace hhtdae
