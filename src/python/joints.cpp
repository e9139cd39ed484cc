/* Fields of joints, primitives, couplers and motions, joints.h */
#include "fields.h"

namespace hhtdae
{

/* The functions Fields() must be in the namespace of the kinds for argument-dependent lookup */
template <class S> using HasPair = std::enable_if_t<sizeof(S) == 2 * sizeof(Marker)>;
template <class S, class F, class = HasPair<S>> static void Fields(S &s, F &f) { f("i", s.i), f("j", s.j); }
template <class S, class F> static void Pair(S &s, F &f) { f("i", s.i), f("j", s.j); }
template <class S, class F> static void Two(S &s, F &f) { f("i1", s.i1), f("j1", s.j1), f("i2", s.i2), f("j2", s.j2); }

template <class F> static void Fields(Screw &s, F &f) { Pair(s, f), f("pitch", s.pitch); }
template <class F> static void Fields(Gear &s, F &f) { Two(s, f), f("ratio", s.ratio); }
template <class F> static void Fields(RackAndPinion &s, F &f) { Two(s, f), f("radius", s.radius); }
template <class F> static void Fields(Coupler &s, F &f) { f("terms", s.terms); }
template <class F> static void Fields(GearMesh &s, F &f) { Two(s, f), f("mesh", s.mesh); }
template <class F> static void Fields(RackMesh &s, F &f) { Two(s, f), f("mesh", s.mesh); }
template <class F> static void Fields(PointDistance &s, F &f) { Pair(s, f), f("length", s.length); }
template <class F> static void Fields(PointOnCurve &s, F &f) { Pair(s, f), f("points", s.points), f("closed", s.closed); }
template <class F> static void Fields(RollingDisc &s, F &f) { Pair(s, f), f("radius", s.radius); }
template <class F> static void Fields(RollingSphere &s, F &f) { Pair(s, f), f("radius", s.radius); }
template <class F> static void Fields(UserConstraint &s, F &f) { f("rows", s.rows); }
template <class F> static void Fields(RotationalMotion &s, F &f) { Pair(s, f), f("function", s.function), f("of", s.of); }
template <class F> static void Fields(TranslationalMotion &s, F &f) { Pair(s, f), f("function", s.function), f("of", s.of), f("axis", s.axis); }

namespace python
{

void RegisterJoints(Kinds &k)
{
  Register<Spherical>(k, "Spherical");
  Register<Revolute>(k, "Revolute");
  Register<Universal>(k, "Universal");
  Register<ConstantVelocity>(k, "ConstantVelocity");
  Register<Translational>(k, "Translational");
  Register<Cylindrical>(k, "Cylindrical");
  Register<Planar>(k, "Planar");
  Register<Fixed>(k, "Fixed");
  Register<Screw>(k, "Screw");
  Register<Gear>(k, "Gear");
  Register<RackAndPinion>(k, "RackAndPinion");
  Register<Coupler>(k, "Coupler");
  Register<GearMesh>(k, "GearMesh");
  Register<RackMesh>(k, "RackMesh");
  Register<InLine>(k, "InLine");
  Register<InPlane>(k, "InPlane");
  Register<ParallelAxes>(k, "ParallelAxes");
  Register<Perpendicular>(k, "Perpendicular");
  Register<Orientation>(k, "Orientation");
  Register<PointDistance>(k, "PointDistance");
  Register<PointOnCurve>(k, "PointOnCurve");
  Register<RollingDisc>(k, "RollingDisc");
  Register<RollingSphere>(k, "RollingSphere");
  Register<KnifeEdge>(k, "KnifeEdge");
  Register<UserConstraint>(k, "UserConstraint");
  Register<RotationalMotion>(k, "RotationalMotion");
  Register<TranslationalMotion>(k, "TranslationalMotion");
}

} // namespace python
} // namespace hhtdae
