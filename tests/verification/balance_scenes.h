/* Small scenes, one for each kind of element, in which each of its loads acts on bodies that move and rotate in space
   or in the plane */
#ifndef HHTDAE_TESTS_BALANCE_SCENES_H
#define HHTDAE_TESTS_BALANCE_SCENES_H

#include "balance/newton_euler.h"
#include "support.h"
#include <memory>

namespace hhtest
{

using namespace hhtdae;

struct BalanceScene {
  std::shared_ptr<Scene> scene;
  Specs                  specs;
  bool                   planar;
  Body                   a, b; /* two bodies that move and rotate from the start */

  explicit BalanceScene(bool plane)
      : scene(std::make_shared<Scene>(PETSC_COMM_SELF, plane ? Space::Planar : Space::Spatial)), planar(plane)
  {
    scene->gravity(plane ? Vector3(1, -9.81, 0) : Vector3(1, 2, -9.81));
    a                       = body("a", {0, 0, 0}, 0.3);
    b                       = body("b", plane ? Vector3(1.1, 0.3, 0) : Vector3(1.1, 0.3, 0.2), -0.4);
    scene->start().assembly = Assembly::Project;
  }
  Body body(const std::string &name, const Vector3 &at, double turn)
  {
    RigidBody r;
    r.mass             = 1.5 + turn;
    r.inertia          = Vector3(0.2, 0.3, 0.4).asDiagonal();
    r.position         = at;
    r.rotation         = planar ? Eigen::AngleAxisd(turn, Vector3::UnitZ()).toRotationMatrix()
                                : Eigen::AngleAxisd(turn, Vector3(1, 2, 2).normalized()).toRotationMatrix();
    r.velocity         = planar ? Vector3(0.4, turn, 0) : Vector3(0.4, turn, -0.3);
    r.angular_velocity = planar ? Vector3(0, 0, 1 + turn) : Vector3(0.7, -0.5, 1 + turn);
    r.center           = planar ? Vector3(0.05, -0.02, 0) : Vector3(0.05, -0.02, 0.03);
    return scene->add(name, r);
  }
  Marker at(Body on, const Vector3 &x, double turn = 0)
  {
    const Vector3 axis = planar ? Vector3::UnitZ() : Vector3(2, -1, 2).normalized();
    return scene->markerAt(on, planar ? Vector3(x(0), x(1), 0) : x, Eigen::AngleAxisd(turn, axis).toRotationMatrix());
  }
  template <class Spec> Element add(const Spec &s) { return specs.add(*scene, "", s); }
};

struct BalanceCase {
  std::string                         name;
  bool                                planar;
  std::function<void(BalanceScene &)> make;
};

/* A joint between the two bodies; a spring on one of them makes the loads of the joint vary */
template <class Joint> BalanceCase JointCase(const std::string &name, bool planar, double bend = 0)
{
  return {name, planar, [bend](BalanceScene &s) {
            const Vector3 x(0.6, 0.2, 0.1);
            const Marker  j = s.at(s.a, x, 0.5),
                         i  = s.scene->markerAt(
                              s.b, s.planar ? Vector3(0.6, 0.2, 0) : x,
                              Matrix3(DataOf(*s.scene).frame(j).R * Eigen::AngleAxisd(bend, Vector3::UnitX())));
            s.add(Joint{i, j});
            s.add(SpringDamper{s.at(s.b, {1.4, 0.5, 0.4}), s.at(s.scene->ground(), {2, 2, 1}), 40, 1.5});
          }};
}

inline std::vector<BalanceCase> JointCases()
{
  std::vector<BalanceCase> all = {JointCase<Spherical>("spherical", false),
                                  JointCase<Revolute>("revolute", false),
                                  JointCase<Revolute>("revolute, planar", true),
                                  JointCase<Universal>("universal", false, M_PI / 2),
                                  JointCase<ConstantVelocity>("constant velocity", false, 0.4),
                                  JointCase<Translational>("translational", false),
                                  JointCase<Translational>("translational, planar", true),
                                  JointCase<Cylindrical>("cylindrical", false),
                                  JointCase<Planar>("planar joint", false),
                                  JointCase<Fixed>("fixed", false),
                                  JointCase<Fixed>("fixed, planar", true),
                                  JointCase<Screw>("screw", false),
                                  JointCase<InLine>("in-line", false),
                                  JointCase<InPlane>("in-plane", false),
                                  JointCase<ParallelAxes>("parallel axes", false),
                                  JointCase<Perpendicular>("perpendicular", false, M_PI / 2),
                                  JointCase<Orientation>("orientation", false)};
  for (bool planar : {false, true})
    all.push_back({planar ? "point distance, planar" : "point distance", planar, [](BalanceScene &s) {
                     s.add(PointDistance{s.at(s.b, {1.3, 0.1, 0.2}), s.at(s.a, {0.1, 0.2, -0.1})});
                     s.add(PointDistance{s.at(s.a, {0.3, -0.1, 0.2}), s.at(s.scene->ground(), {-1, 0.2, 0.1})});
                   }});
  all.push_back({"point on curve", false, [](BalanceScene &s) {
                   PointOnCurve c{s.at(s.b, {1.1, 0.3, 0.2}), s.scene->markerAt(s.a, {1.1, 0.3, 0.2}), {}, false};
                   for (int k = -3; k <= 3; k++) c.points.emplace_back(std::sin(0.5 * k), 0.3 * k * k * 0.2, 0.2 * k);
                   s.add(c);
                 }});
  all.push_back({"rolling sphere on a tilting plate", false, [](BalanceScene &s) {
                   s.add(Spherical{s.at(s.a, {0, 0, 0.4}), s.at(s.scene->ground(), {0, 0, 0.4})});
                   s.add(RollingSphere{s.scene->marker(s.b), s.scene->markerAt(s.a, {1.1, 0.3, -0.3}), 0.5});
                 }});
  all.push_back({"rolling disc", false, [](BalanceScene &s) {
                   s.add(hhtdae::RollingDisc{
                       s.scene->marker(s.b, {0, 0, 0}, Eigen::AngleAxisd(1.3, Vector3::UnitX()).toRotationMatrix()),
                       s.at(s.scene->ground(), {0, 0, -0.3}), 0.5});
                 }});
  all.push_back({"knife edge", false, [](BalanceScene &s) {
                   s.add(KnifeEdge{s.at(s.b, {1.4, 0.3, 0.2}, 0.1), s.at(s.scene->ground(), {0, 0, 0})});
                   s.add(SpringDamper{s.at(s.b, {1.4, 0.5, 0.4}), s.at(s.a, {0, 0.5, 0.2}), 40, 1.5});
                 }});
  all.push_back({"motions", false, [](BalanceScene &s) {
                   const Marker i = s.at(s.b, {0.6, 0.2, 0.1}, 0.5),
                                j = s.scene->markerAt(s.a, {0.6, 0.2, 0.1}, DataOf(*s.scene).frame(i).R);
                   s.add(Cylindrical{i, j});
                   s.add(RotationalMotion{i, j, TimeFunction::harmonic(0.5, 3)});
                   s.add(TranslationalMotion{i, j, TimeFunction::harmonic(0.2, 4), MotionOf::Velocity});
                 }});
  for (bool planar : {false, true})
    all.push_back({planar ? "gear and rack, planar" : "gear and rack", planar, [](BalanceScene &s) {
                     const Body c  = s.body("c", {-0.5, 0.4, 0}, 0.2);
                     const auto on = [&](Body k, const Vector3 &x) {
                       return std::make_pair(s.at(k, x, 0.3), s.at(s.scene->ground(), x, 0.3));
                     };
                     const auto p = on(s.a, {0.1, 0, 0}), q = on(s.b, {1.1, 0.2, 0.1}), t = on(c, {-0.5, 0.4, 0});
                     s.add(Revolute{p.first, p.second});
                     s.add(Revolute{q.first, q.second});
                     s.add(Translational{t.first, t.second});
                     s.add(Gear{p.first, p.second, q.first, q.second, -1.7});
                     s.add(RackAndPinion{q.first, q.second, t.first, t.second, 0.4});
                   }});
  for (bool planar : {false, true})
    all.push_back({planar ? "gear and coupler on a carrier, planar" : "gear and coupler on a carrier", planar,
                   [](BalanceScene &s) {
                     const Body c = s.body("c", {-0.5, 0.4, 0}, 0.2), d = s.body("d", {0.4, -0.8, 0}, -0.2);
                     const auto on = [&](Body k, const Vector3 &x) {
                       const Marker i = s.at(k, x, 0.3);
                       return std::make_pair(
                           i, s.scene->markerAt(s.a, DataOf(*s.scene).frame(i).x, DataOf(*s.scene).frame(i).R));
                     };
                     s.add(Revolute{s.at(s.a, {0.2, 0.1, 0}), s.at(s.scene->ground(), {0.2, 0.1, 0})});
                     const auto p = on(s.b, {1.1, 0.2, 0.1}), q = on(c, {-0.5, 0.3, 0}), t = on(d, {0.4, -0.8, 0.1});
                     s.add(Revolute{p.first, p.second});
                     s.add(Revolute{q.first, q.second});
                     s.add(Translational{t.first, t.second});
                     s.add(Gear{p.first, p.second, q.first, q.second, -1.7});
                     Coupler k;
                     k.terms = {{q.first, q.second, true, 0.7}, {t.first, t.second, false, 1.3}};
                     s.add(k);
                     s.add(SpringDamper{s.at(s.b, {1.4, 0.5, 0.4}), s.at(s.scene->ground(), {2, 2, 1}), 40, 1.5});
                   }});
  all.push_back({"coupler of three", false, [](BalanceScene &s) {
                   const Body c = s.body("c", {-0.5, 0.4, 0}, 0.2);
                   Coupler    k;
                   int        n = 0;
                   for (Body body : {s.a, s.b, c}) {
                     const Vector3 x(0.3 * n, 0.2, 0.1);
                     const Marker  i = s.at(body, x, 0.3 + n), j = s.at(s.scene->ground(), x, 0.3 + n);
                     if (n == 1)
                       s.add(Translational{i, j});
                     else
                       s.add(Revolute{i, j});
                     k.terms.push_back({i, j, n != 1, 0.7 + n});
                     n++;
                   }
                   s.add(k);
                 }});
  return all;
}

inline std::vector<BalanceCase> ForceCases()
{
  std::vector<BalanceCase> all;
  const auto add = [&](const std::string &name, const std::function<void(BalanceScene &)> &make, bool spatial = true,
                       bool plane = true) {
    if (spatial) all.push_back({name, false, make});
    if (plane) all.push_back({name + ", planar", true, make});
  };
  for (bool state : {false, true}) {
    const std::string as = state ? " as a force state" : "";
    add("spring" + as, [state](BalanceScene &s) {
      s.add(SpringDamper{s.at(s.b, {1.3, 0.1, 0.2}), s.at(s.a, {0.1, 0.2, -0.1}), 50, 2, 0.7, 3, state});
    });
    add("nonlinear spring" + as, [state](BalanceScene &s) {
      s.add(NonlinearSpring{s.at(s.b, {1.3, 0.1, 0.2}), s.at(s.a, {0.1, 0.2, -0.1}),
                            [](const Real &l, const Real &v) -> Real { return 30. * l * l + v; }, state});
    });
    add("bushing" + as, [state](BalanceScene &s) {
      Bushing f{s.at(s.b, {0.7, 0.1, 0.2}, 0.2), s.at(s.a, {0.6, 0.2, 0.1}, 0.1)};
      f.stiffness           = {50, 70, 90};
      f.torsional_stiffness = {9, 8, 7};
      f.damping             = {1, 2, 3};
      f.torsional_damping   = {0.3, 0.2, 0.1};
      if (s.planar)
        f.force = {1, 2, 0};
      else
        f.force = {1, 2, 3};
      f.state = state;
      s.add(f);
    });
    add("beam" + as, [state](BalanceScene &s) {
      Beam f{s.at(s.b, {1, 0.1, 0.1}, 0.2), s.at(s.a, {0.1, 0.2, -0.1}, 0.1)};
      f.E    = 1e4;
      f.G    = 4e3;
      f.area = 0.01;
      f.Iyy = f.Izz = 1e-3;
      f.J           = 2e-3;
      f.damping     = 0.01;
      f.state       = state;
      s.add(f);
    });
    add("torsional springs" + as, [state](BalanceScene &s) {
      const Marker i = s.at(s.b, {0.6, 0.2, 0.1}, 0.4),
                   j = s.scene->markerAt(s.a, s.planar ? Vector3(0.6, 0.2, 0) : Vector3(0.6, 0.2, 0.1),
                                         DataOf(*s.scene).frame(i).R);
      s.add(Revolute{i, j});
      s.add(TorsionalSpringDamper{i, j, 5, 0.3, 0.5, 1, state});
      s.add(NonlinearTorsionalSpring{i, j, [](const Real &x, const Real &v) -> Real { return -2. * sin(x) - 0.1 * v; },
                                     state});
    });
    add("user's forces" + as, [state](BalanceScene &s) {
      UserForce f{
          s.at(s.b, {1.3, 0.1, 0.2}, 0.3), s.at(s.a, {0.1, 0.2, -0.1}), s.at(s.a, {0, 0.1, 0}, 0.7), {}, {}, state};
      for (int c = 0; c < 3; c++) {
        f.force.push_back(Expression{{Measure::time()}, [c, flat = s.planar](const Real *m) -> Real {
                                       return flat && c == 2 ? Real(0.) : Real((1. + c) * cos(3. * m[0] + c));
                                     }});
        f.moment.push_back(Expression{{Measure::time()}, [c, flat = s.planar](const Real *m) -> Real {
                                        return flat && c < 2 ? Real(0.) : Real((0.3 + c) * sin(2. * m[0] + c));
                                      }});
      }
      s.add(f);
      f.j = Marker{};
      f.force.clear();
      s.add(f);
      s.add(UserScalarForce{s.at(s.b, {1, 0, 0}), s.at(s.a, {0.1, 0.2, -0.1}),
                            Expression{{Measure::time()}, [](const Real *m) -> Real { return 3. * cos(m[0]); }}, false,
                            state});
      s.add(UserScalarForce{s.at(s.b, {1, 0, 0}, 0.2), s.at(s.a, {0.1, 0.2, -0.1}, 0.5),
                            Expression{{Measure::time()}, [](const Real *m) -> Real { return 2. * cos(m[0]); }}, true,
                            state});
    });
    ContactLaw law;
    law.stiffness     = 2e3;
    law.damping       = 0.1;
    law.friction      = 0.3;
    law.slip_velocity = 0.05;
    add("contacts" + as, [=](BalanceScene &s) {
      const Vector3 n = s.planar ? Vector3(0, 1, 0) : Vector3(0, 0, 1), low = -0.52 * n;
      const Marker  mid = s.scene->marker(s.a);
      s.add(SpherePlane{mid, s.at(s.scene->ground(), low), 0.55, law, state});
      s.add(EllipsoidPlane{s.scene->marker(s.b), s.at(s.scene->ground(), low), {0.9, 0.8, 0.85}, law, state});
      s.add(SphereSphere{s.scene->marker(s.b), mid, 0.6, 0.6, law, state});
      const Body c = s.body("c", 0.9 * n, 0.1);
      s.add(SphereBox{s.scene->marker(c), mid, 0.5, {0.45, 0.45, 0.45}, law, state});
    });
    add(
        "tire" + as,
        [=](BalanceScene &s) {
          s.add(TorusPlane{s.scene->marker(s.a), s.at(s.scene->ground(), {0, 0, -0.3}, 0.2), 0.5, 0.1, law, state});
        },
        true, false);
  }
  add("friction in joints", [](BalanceScene &s) {
    const Vector3 x(0.6, 0.2, 0.1), y(1.6, 0.5, 0.1), z(-0.4, 0.1, 0.2);
    const Body    c     = s.body("c", {1.9, 0.6, s.planar ? 0 : 0.1}, 0.2);
    const auto    joint = [&](Body i, Body j, const Vector3 &at) {
      const Marker m = s.at(i, at, 0.4);
      return std::make_pair(m, s.scene->markerAt(j, DataOf(*s.scene).frame(m).x, DataOf(*s.scene).frame(m).R));
    };
    const auto    r = joint(s.b, s.a, x), t = joint(c, s.b, y);
    const Element pin = s.add(Revolute{r.first, r.second}), slide = s.add(Translational{t.first, t.second});
    s.add(JointFriction{pin, 0.2, 0.1, 0.05});
    s.add(JointFriction{slide, 0.2, 0.1, 0.05});
    s.add(SpringDamper{s.at(s.b, {1.4, 0.5, 0.4}), s.at(s.scene->ground(), {2, 2, 1}), 40, 1.5});
    if (s.planar) return;
    const Body    d   = s.body("d", {-0.8, 0, 0.2}, -0.1);
    const auto    k   = joint(d, s.a, z);
    const Element rod = s.add(Cylindrical{k.first, k.second});
    s.add(JointFriction{rod, 0.2, 0.1, 0.05});
    const Body    e    = s.body("e", {-1.4, 0, 0.2}, -0.1);
    const Element ball = s.add(Spherical{s.at(e, {-1.2, 0, 0.1}), s.at(d, {-1.2, 0, 0.1})});
    s.add(JointFriction{ball, 0.2, 0.1, 0.05});
  });
  return all;
}

/* Cases whose forces have a potential energy: no damping, no friction */
inline std::vector<BalanceCase> PotentialCases()
{
  std::vector<BalanceCase> all;
  for (bool plane : {false, true}) {
    const std::string in = plane ? ", planar" : "";
    all.push_back({"springs" + in, plane, [](BalanceScene &s) {
                     s.add(SpringDamper{s.at(s.b, {1.3, 0.1, 0.2}), s.at(s.a, {0.1, 0.2, -0.1}), 50, 0, 0.7, 3});
                     s.add(SpringDamper{s.at(s.a, {0, 0.1, 0.2}), s.at(s.scene->ground(), {0, 1, 1}), 50, 0, 0.7, 3});
                   }});
    all.push_back({"bushing" + in, plane, [](BalanceScene &s) {
                     Bushing f{s.at(s.b, {0.7, 0.1, 0.2}, 0.2), s.at(s.a, {0.6, 0.2, 0.1}, 0.1)};
                     f.stiffness           = {50, 70, 90};
                     f.torsional_stiffness = {9, 8, 7};
                     f.force               = {1, 2, s.planar ? 0. : 3.};
                     f.moment              = {s.planar ? 0. : 0.1, 0, 0.2};
                     s.add(f);
                   }});
    all.push_back({"beam" + in, plane, [](BalanceScene &s) {
                     Beam f{s.at(s.b, {1, 0.1, 0.1}, 0.2), s.at(s.a, {0.1, 0.2, -0.1}, 0.1)};
                     f.E    = 1e4;
                     f.G    = 4e3;
                     f.area = 0.01;
                     f.Iyy = f.Izz = 1e-3;
                     f.J           = 2e-3;
                     s.add(f);
                   }});
    all.push_back({"torsional spring" + in, plane, [](BalanceScene &s) {
                     const Marker i = s.at(s.b, {0.6, 0.2, 0.1}, 0.4);
                     const Marker j = s.scene->markerAt(s.a, DataOf(*s.scene).frame(i).x, DataOf(*s.scene).frame(i).R);
                     s.add(Revolute{i, j});
                     s.add(TorsionalSpringDamper{i, j, 5, 0, 0.5, 1});
                   }});
    all.push_back({"contacts" + in, plane, [](BalanceScene &s) {
                     ContactLaw law;
                     law.stiffness   = 2e3;
                     const Vector3 n = s.planar ? Vector3(0, 1, 0) : Vector3(0, 0, 1), low = -0.52 * n;
                     s.add(SpherePlane{s.scene->marker(s.a), s.at(s.scene->ground(), low), 0.55, law});
                     law.exponent = 1;
                     s.add(EllipsoidPlane{s.scene->marker(s.b), s.at(s.scene->ground(), low), {0.9, 0.8, 0.85}, law});
                     s.add(SphereSphere{s.scene->marker(s.b), s.scene->marker(s.a), 0.6, 0.6, law});
                   }});
  }
  return all;
}

} // namespace hhtest

#endif
