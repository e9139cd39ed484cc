/* Checks of a description before unknowns are numbered; all errors are reported at once. */
#include "extension.h"
#include "journal.h"
#include "measures.h"
#include "runtime.h"
#include "symmetric.h"
#include <cmath>
#include <set>

namespace hhtdae
{

namespace
{

/* rounding of the description: allowed deviation of lengths, velocities and axes that must be exactly zero, unit or
   parallel, each in its unit */
constexpr double angle_tolerance = 1e-8;

std::string Text(const Vector3 &x) { return Show(x(0)) + ", " + Show(x(1)) + ", " + Show(x(2)); }

class Check
{
public:
  explicit Check(SceneData &s) : s_(s), errors_(s.errors) {}

  void all()
  {
    for (const BodyData &b : s_.bodies) body(b);
    for (std::size_t m = 0; m < s_.markers.size(); m++) marker((PetscInt)m);
    for (const ElementData &e : s_.elements) element(e);
    names();
    CheckExpressions(s_, errors_);
  }
  const std::vector<std::string> &errors() const { return errors_; }

private:
  SceneData               &s_;
  std::vector<std::string> errors_;

  void require(bool condition, const std::string &who, const std::string &what)
  {
    if (!condition) errors_.push_back(who + ": " + what);
  }

  void body(const BodyData &b)
  {
    if (b.massless) return; /* the frame of an attachment follows its body */
    const std::string who = "body " + b.name;
    require(std::isfinite(b.mass) && b.mass >= 0, who, "mass is " + Show(b.mass) + ", must be positive, or 0 where joints determine what it does");
    require(b.r.allFinite() && b.v.allFinite() && b.w.allFinite(), who,
            "position, velocity and angular velocity must be finite");
    if (b.point) {
      inPlane(b, who);
      return;
    }
    const double off = b.A.allFinite() ? (b.A.transpose() * b.A - Matrix3::Identity()).norm() : INFINITY;
    require(off < angle_tolerance, who,
            "rotation is not orthonormal (R^T R misses the identity by " + Show(off) + "); give body axes as columns");
    if (off < angle_tolerance)
      require(b.A.determinant() > 0, who, "rotation is left-handed; its third column must be the first x the second");
    if (s_.planar)
      require(std::isfinite(b.inertia(2, 2)) && b.inertia(2, 2) >= 0, who,
              "inertia(2,2) is " + Show(b.inertia(2, 2)) + ", must be positive, or 0 where joints determine the angle");
    else
      inertia(b, who);
    inPlane(b, who);
  }

  void inertia(const BodyData &b, const std::string &who)
  {
    if (!b.inertia.allFinite()) {
      require(false, who, "inertia must be finite");
      return;
    }
    const double scale = b.inertia.norm(), skew = (b.inertia - b.inertia.transpose()).norm();
    require(skew <= 1e-10 * scale, who,
            "inertia is not symmetric (off by " + Show(skew) +
                "); products of inertia have the same sign on both sides");
    if (skew > 1e-10 * scale) return;
    const Vector3     I      = SymmetricEigen(b.inertia).values;
    const std::string values = "principal moments of inertia are " + Text(I);
    if (I(0) < -1e-12 * scale) {
      require(false, who, values + ", must be positive");
      return;
    }
    require(I(2) <= (I(0) + I(1)) * (1 + 1e-6), who,
            values + ": the largest exceeds the sum of the others, which no body has; check the units, and that they "
                     "are about the centre of mass");
  }

  /* Requires that a body of a planar scene lies and moves in the plane */
  void inPlane(const BodyData &b, const std::string &who)
  {
    if (!s_.planar) return;
    require(std::abs(b.r(2)) < angle_tolerance && std::abs(b.v(2)) < angle_tolerance, who,
            "z is " + Show(b.r(2)) + " and its velocity " + Show(b.v(2)) + "; in a planar scene both are 0");
    require(b.w(0) == 0 && b.w(1) == 0, who, "angular velocity is " + Text(b.w) + "; in a planar scene it is along z");
    require(b.point || std::abs(b.A(2, 2) - 1) < angle_tolerance, who,
            "its z axis is not along z, as in a planar scene it must be");
  }

  void marker(PetscInt id)
  {
    const MarkerData &m = s_.markers[id];
    if (!s_.planar || m.body < -1 || !m.s.allFinite() || !m.R.allFinite())
      return; /* these errors were reported when the marker was made */
    const auto        name = s_.marker_names.find(id);
    const std::string who =
        "marker " + (name == s_.marker_names.end() ? std::to_string(id) + " on " + s_.bodyName(m.body) : name->second);
    require(std::abs(m.s(2)) < angle_tolerance, who,
            "z is " + Show(m.s(2)) + "; markers of a planar scene lie in its plane, z = 0");
    require(std::abs(m.R(2, 2) - 1) < angle_tolerance, who,
            "its z axis is " + Text(Vector3(m.R.col(2))) + "; in a planar scene it is along z");
  }

  void element(const ElementData &e)
  {
    if (!s_.valid(e.i) || !s_.valid(e.j)) return; /* reported when the element was made */
    const PetscInt i = s_.markers[e.i.id].body, j = s_.markers[e.j.id].body;
    if (i < -1 || j < -1 || i != j) return;
    const std::string who = std::string(e.type) + " " + e.name;
    if (e.kind == ElementData::Force) return; /* a force on a single body has no effect */
    for (const std::string &known : s_.errors)
      if (known.compare(0, who.size() + 1, who + ":") == 0) return;
    require(false, who,
            i < 0 ? "both markers are on the ground; one must be on a body"
                  : "both markers are on " + s_.bodyName(i) + "; they must be on different bodies");
  }

  struct Named {
    const std::string &name;
  };
  template <class List> void unique(const char *what, const List &list)
  {
    std::set<std::string> seen, told;
    for (const auto &x : list)
      if (!seen.insert(x.name).second && told.insert(x.name).second)
        require(false, std::string(what) + " " + x.name,
                "the name is given more than once; outputs and messages need it to be unique");
  }
  void names()
  {
    std::vector<Named> bodies;
    for (const BodyData &b : s_.bodies) bodies.push_back({b.name});
    for (const auto &x : s_.extensions) bodies.push_back({x->bodyName()});
    unique("body", bodies);
    unique("element", s_.elements);
    unique("variable", s_.variables);
    unique("state", s_.states);
  }
};

} // namespace

namespace
{

/* Reports all errors as one, up to the length of PETSc's messages */
PetscErrorCode Report(const SceneData &s, const std::vector<std::string> &errors, const char *what)
{
  std::string       all;
  std::size_t       k    = 0;
  const std::size_t room = 1500;
  PetscFunctionBegin;
  for (; k < errors.size() && all.size() + errors[k].size() < room; k++) all += "\n  " + errors[k];
  for (std::size_t i = k; i < errors.size(); i++) PetscCall(PetscInfo(nullptr, "scene: %s\n", errors[i].c_str()));
  if (k < errors.size()) all += "\n  and " + std::to_string(errors.size() - k) + " more, see -info";
  PetscCheck(errors.empty(), s.comm, PETSC_ERR_ARG_WRONG, "%s:%s", what, all.c_str());
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode TellOnce(SceneData &s, const std::string &text)
{
  PetscFunctionBegin;
  if (s.told.insert(text).second) PetscCall(PetscPrintf(s.comm, "%s", text.c_str()));
  PetscFunctionReturn(0);
}

PetscErrorCode CheckDescription(SceneData &s)
{
  Check check(s);
  PetscFunctionBegin;
  PetscCheck(!s.bodies.empty() || !s.extensions.empty(), s.comm, PETSC_ERR_ARG_WRONGSTATE, "the scene has no bodies");
  check.all();
  PetscCall(Report(s, check.errors(), "the scene cannot be built"));
  if (s.planar && s.gravity(2) != 0) {
    char text[160];
    PetscCall(PetscSNPrintf(text, sizeof(text), "scene: gravity along z, %g, moves nothing: the scene is planar, its bodies move along x and y\n", s.gravity(2)));
    PetscCall(TellOnce(s, text));
  }
  PetscFunctionReturn(0);
}

bool SameStart(const StartPolicy &a, const StartPolicy &b)
{
  return a.assembly == b.assembly && a.tolerance == b.tolerance && a.redundant == b.redundant && a.equilibrium == b.equilibrium && a.view == b.view &&
         a.time == b.time && a.rotations == b.rotations && a.angle_tol == b.angle_tol;
}

/* An error if anything was added since setUp(). StartPolicy may have changed: setUp() then describes the scene anew. */
PetscErrorCode CheckUnchanged(const SceneData &s)
{
  PetscFunctionBegin;
  PetscCall(Report(s, s.errors, "the scene was changed after it was set up"));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
