/* Users' constraints, given as expressions. */
#include "scene/kernels/user_constraint.h"
#include "scene/measures.h"
#include "scene/motions/moving_pair.h"
#include <algorithm>
#include <cmath>

namespace hhtdae
{

namespace
{

constexpr int max_markers = 6; /* largest number of markers of a row, that of the largest kernel below */

bool OfPositions(Measure::Kind k) { return k == Measure::Displacement || k == Measure::Distance || k == Measure::Angle; }
bool OfInputs(Measure::Kind k) { return k == Measure::Value || k == Measure::StateValue; }

/* Builds one row of the element: checks its measures, and assigns the numbers of their markers, angles and inputs in the kernel */
class RowBuilder
{
public:
  RowBuilder(ElementBuilder &e, const Expression &f, int row, const std::string &name, double t)
      : e_(e), given_(f), t_(t), where_("row " + std::to_string(row + 1)), row_(std::make_shared<UserRow>())
  {
    row_->f = UserFunction("user constraint " + name + ", " + where_, f);
    check();
    if (e_.good()) read();
    if (e_.good()) atTheStart();
  }

  const std::vector<Marker> &markers() const { return markers_; }

  void constrain()
  {
    if (markers_.size() <= 2) put<2>();
    else if (markers_.size() <= 4) put<4>();
    else put<max_markers>();
  }

private:
  ElementBuilder          &e_;
  const Expression        &given_;
  double                   t_; /* time of the start */
  std::string              where_;
  std::shared_ptr<UserRow> row_;
  std::vector<Marker>      markers_;
  std::vector<ScalarRef>   inputs_;
  UserRowData              data_;
  bool                     velocities_ = false;
  int                      angles_     = 0;

  void require(bool condition, const std::string &message) { e_.require(condition, where_ + message); }

  void check()
  {
    std::vector<std::string> errors;
    CheckExpression(e_.scene(), where_, given_, errors);
    for (const std::string &error : errors) e_.require(false, error);
    for (const Measure &m : given_.arguments) velocities_ |= UserRow::ofVelocities(m.kind);
    for (std::size_t k = 0; k < given_.arguments.size(); k++) {
      const Measure::Kind kind = given_.arguments[k].kind;
      const std::string   what = ", argument " + std::to_string(k + 1) + " is " + NameOf(kind);
      if (OfInputs(kind)) require(velocities_, what + ": a row of positions has no variables or states, which would take no load; one of velocities may have them");
      else
        require(kind == Measure::Time || OfPositions(kind) || UserRow::ofVelocities(kind),
                what + ": a constraint reads displacements, distances, angles, velocities, rates, angular velocities and time");
      mayTurn(given_.arguments[k], what);
    }
  }

  /* Checks that a moment can act on a body on whose rotation the row depends */
  void mayTurn(const Measure &m, const std::string &what)
  {
    const SceneData &s      = e_.scene();
    const bool       angles = m.kind == Measure::Angle || m.kind == Measure::AngularVelocity;
    const auto       check  = [&](Marker k, const char *marker) {
      if (!s.valid(k) || !s.turnless(s.markers[k.id].body)) return;
      require(false, what + ": marker " + marker + " is on " + s.turnlessName(s.markers[k.id].body) + ", which takes no moment; use a rigid body");
    };
    if (angles) check(m.i, "i");
    if (angles) check(m.j, "j");
    check(m.frame, "`frame`");
  }

  int number(Marker m)
  {
    if (m.id == -1) return -1;
    const auto at = std::find_if(markers_.begin(), markers_.end(), [&](Marker k) { return k.id == m.id; });
    if (at != markers_.end()) return (int)(at - markers_.begin());
    markers_.push_back(m);
    return (int)markers_.size() - 1;
  }

  void read()
  {
    for (const Measure &m : given_.arguments) {
      UserRow::Argument a;
      a.kind      = m.kind;
      a.component = m.component;
      if (OfInputs(m.kind)) {
        a.number = (int)inputs_.size();
        inputs_.push_back({m.kind == Measure::Value ? ScalarRef::Variable : ScalarRef::State, m.target, 0});
      } else if (m.kind != Measure::Time) {
        const Marker of[3] = {m.i, m.j, m.frame};
        for (int i = 0; i < 3; i++) a.marker[i] = number(of[i]);
      }
      if (m.kind == Measure::Angle && angles_ < UserRow::angles) {
        a.number              = angles_;
        data_.memory[angles_] = PrincipalAngle<double>(e_.frame(m.i), e_.frame(m.j));
      }
      angles_ += m.kind == Measure::Angle;
      row_->arguments.push_back(a);
    }
    require((int)markers_.size() <= max_markers, " names " + std::to_string(markers_.size()) + " markers, at most " + std::to_string(max_markers));
    require(angles_ <= UserRow::angles, " has " + std::to_string(angles_) + " angles, at most " + std::to_string(UserRow::angles));
    require((int)inputs_.size() <= UserRow::inputs, " has " + std::to_string(inputs_.size()) + " variables and states, at most " + std::to_string(UserRow::inputs));
    const SceneData &s = e_.scene();
    require(std::any_of(markers_.begin(), markers_.end(), [&](Marker m) { return s.markers[m.id].body >= 0; }), " reads no marker of a body");
    scale();
  }

  /* Sets the scales of measures (UserRow::Argument::reach): for lengths the distance of the markers, for others 1 */
  void scale()
  {
    double size = 0;
    for (Marker m : markers_) size = std::max(size, (e_.frame(m).x - e_.frame(markers_[0]).x).norm());
    for (Marker m : markers_) size = std::max(size, 1e-3 * e_.frame(m).x.norm());
    for (UserRow::Argument &a : row_->arguments) a.reach = (a.kind == Measure::Displacement || a.kind == Measure::Distance) && size > 0 ? size : 1;
  }

  void atTheStart()
  {
    Frame<double> f[max_markers];
    Twist<double> w[max_markers];
    double        z[UserRow::inputs] = {}, x[6 * max_markers] = {}, y[6 * max_markers] = {}, by[UserRow::inputs] = {};
    for (std::size_t k = 0; k < markers_.size(); k++) {
      f[k] = e_.frame(markers_[k]);
      w[k] = e_.scene().twist(markers_[k]);
    }
    const UserRow::At at{f, velocities_ ? w : nullptr, t_, z, data_.memory};
    double            value = 0, sum = 0;
    try {
      for (std::size_t i = 0; i < inputs_.size(); i++) z[i] = InitialInput(e_.scene(), inputs_[i], t_);
      value = row_->value(at);
      row_->gradient(at, x, y, by);
      for (int d = 0; d < 6 * max_markers; d++) sum += std::abs(x[d]) + std::abs(y[d]);
      require(!velocities_ || row_->linear(at), " is not linear in its velocities, with factors that do not depend on variables and states, as a row of velocities must be");
    } catch (const std::exception &error) {
      e_.require(false, where_ + " has failed at the start: " + error.what());
    }
    require(std::isfinite(value), " is " + Show(value) + " at the start, must be finite");
    require(std::isfinite(sum), " has no finite derivatives at the start; the distance of markers that coincide has none");
  }
  template <int M> void put()
  {
    if (angles_ > 0) enter<M, UserRow::angles>();
    else enter<M, 0>();
  }
  template <int M, int Angles> void enter()
  {
    std::vector<Marker> padded = markers_;
    padded.resize(M, markers_[0]);
    data_.row = row_;
    if (velocities_) e_.constrain<UserVelocity<M, Angles>>(padded, data_, inputs_);
    else e_.constrain<UserPosition<M, Angles>>(padded, data_, {});
  }
};

} // namespace

/* One multiplier per row; the load is the multiplier times the derivatives of the row's expression. */
template <> Element Scene::enter(const std::string &name, const UserConstraint &s)
{
  Marker i, j; /* the first marker on a body, and the first marker on another body */
  for (const Expression &f : s.rows)
    for (const Measure &m : f.arguments)
      for (Marker k : {m.i, m.j, m.frame}) {
        if (!data().valid(k)) continue;
        const PetscInt body = data().markers[k.id].body;
        if (i.id < 0 && body >= 0) i = k;
        else if (i.id >= 0 && j.id < 0 && body != data().markers[i.id].body) j = k;
      }
  if (i.id < 0) i = data().markers.empty() ? marker(ground()) : Marker{0}; /* any marker: the rows then report that they have none */
  ElementBuilder e(*this, name, "user constraint", ElementData::Joint, i, j, false);
  e.require(!s.rows.empty(), "it has no rows");
  std::vector<RowBuilder> rows;
  for (std::size_t r = 0; r < s.rows.size() && e.good(); r++) rows.emplace_back(e, s.rows[r], (int)r, name, start_.time);
  for (RowBuilder &r : rows)
    if (e.good()) r.constrain();
  return e.done();
}

} // namespace hhtdae
