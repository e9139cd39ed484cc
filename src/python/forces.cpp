/* Fields of force elements, forces.h */
#include "fields.h"

namespace hhtdae
{

/* The functions Fields() must be in the namespace of the kinds for argument-dependent lookup */
template <class S, class F> static void Pair(S &s, F &f) { f("i", s.i), f("j", s.j), f("state", s.state); }

template <class F> static void Fields(SpringDamper &s, F &f)
{
  Pair(s, f), f("stiffness", s.stiffness), f("damping", s.damping), f("length", s.length), f("preload", s.preload);
}
template <class F> static void Fields(NonlinearSpring &s, F &f) { Pair(s, f), f("tension", s.tension); }
template <class F> static void Fields(TorsionalSpringDamper &s, F &f)
{
  Pair(s, f), f("stiffness", s.stiffness), f("damping", s.damping), f("angle", s.angle), f("preload", s.preload);
}
template <class F> static void Fields(NonlinearTorsionalSpring &s, F &f) { Pair(s, f), f("moment", s.moment); }
template <class F> static void Fields(Bushing &s, F &f)
{
  Pair(s, f), f("stiffness", s.stiffness), f("torsional_stiffness", s.torsional_stiffness), f("damping", s.damping);
  f("torsional_damping", s.torsional_damping), f("force", s.force), f("moment", s.moment);
}
template <class F> static void Fields(Beam &s, F &f)
{
  Pair(s, f), f("length", s.length), f("E", s.E), f("G", s.G), f("area", s.area), f("Iyy", s.Iyy), f("Izz", s.Izz), f("J", s.J);
  f("shear_y", s.shear_y), f("shear_z", s.shear_z), f("damping", s.damping);
}
template <class F> static void Fields(UserForce &s, F &f) { Pair(s, f), f("frame", s.frame), f("force", s.force), f("moment", s.moment); }
template <class F> static void Fields(UserScalarForce &s, F &f) { Pair(s, f), f("value", s.value), f("rotational", s.rotational); }
template <class F> static void Fields(ModalLoad &s, F &f) { f("body", s.body), f("load", s.load), f("scale", s.scale), f("state", s.state); }
template <class F> static void Fields(NodeContact &s, F &f)
{
  f("body", s.body), f("nodes", s.nodes), f("radius", s.radius), f("j", s.j), f("radius_j", s.radius_j), f("law", s.law);
}
template <class F> static void Fields(SpherePlane &s, F &f) { Pair(s, f), f("radius", s.radius), f("law", s.law); }
template <class F> static void Fields(EllipsoidPlane &s, F &f) { Pair(s, f), f("semiaxes", s.semiaxes), f("law", s.law); }
template <class F> static void Fields(TorusPlane &s, F &f) { Pair(s, f), f("radius", s.radius), f("tube", s.tube), f("law", s.law); }
template <class F> static void Fields(SphereSphere &s, F &f) { Pair(s, f), f("radius_i", s.radius_i), f("radius_j", s.radius_j), f("law", s.law); }
template <class F> static void Fields(SphereBox &s, F &f) { Pair(s, f), f("radius", s.radius), f("half", s.half), f("law", s.law); }
template <class S, class F> static void Stop(S &s, F &f) { Pair(s, f), f("lower", s.lower), f("upper", s.upper), f("law", s.law); }
template <class F> static void Fields(RotationalStop &s, F &f) { Stop(s, f); }
template <class F> static void Fields(TranslationalStop &s, F &f) { Stop(s, f), f("axis", s.axis); }
template <class F> static void Fields(DistanceStop &s, F &f) { Stop(s, f); }
template <class F> static void Fields(JointFriction &s, F &f)
{
  f("joint", s.joint), f("coefficient", s.coefficient), f("radius", s.radius), f("slip_velocity", s.slip_velocity);
}

namespace python
{

void RegisterForces(Kinds &k)
{
  Register<SpringDamper>(k, "SpringDamper");
  Register<NonlinearSpring>(k, "NonlinearSpring");
  Register<TorsionalSpringDamper>(k, "TorsionalSpringDamper");
  Register<NonlinearTorsionalSpring>(k, "NonlinearTorsionalSpring");
  Register<Bushing>(k, "Bushing");
  Register<Beam>(k, "Beam");
  Register<UserForce>(k, "UserForce");
  Register<UserScalarForce>(k, "UserScalarForce");
  Register<ModalLoad>(k, "ModalLoad");
  Register<NodeContact>(k, "NodeContact");
  Register<SpherePlane>(k, "SpherePlane");
  Register<EllipsoidPlane>(k, "EllipsoidPlane");
  Register<TorusPlane>(k, "TorusPlane");
  Register<SphereSphere>(k, "SphereSphere");
  Register<SphereBox>(k, "SphereBox");
  Register<RotationalStop>(k, "RotationalStop");
  Register<TranslationalStop>(k, "TranslationalStop");
  Register<DistanceStop>(k, "DistanceStop");
  Register<JointFriction>(k, "JointFriction");
}

} // namespace python
} // namespace hhtdae
