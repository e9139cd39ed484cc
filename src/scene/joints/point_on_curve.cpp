/* Point on curve: the point of contact at the start is the point of the whole curve that is closest to i. */
#include "joint_builder.h"
#include "scene/kernels/curve.h"

namespace hhtdae
{

namespace
{

template <int R> void Enter(JointBuilder &e, std::shared_ptr<const Curve> curve)
{
  const Frame<double>       i = e.start(0), j = e.start(1);
  typename OnCurve<R>::Data data;
  data.memory[0] = curve->path().wrapped(curve->closest(j.R.transpose() * (i.x - j.x)));
  data.curve     = std::move(curve);
  e.rows<OnCurve<R>>(data);
}

} // namespace

/* Multipliers: forces on i's body along the two normals of the curve; planar: along z x tangent, with the tangent in the direction
   of the points */
template <> Element Scene::enter(const std::string &name, const PointOnCurve &s)
{
  JointBuilder e(*this, name, "point on curve", s.i, s.j);
  auto         curve = std::make_shared<const Curve>(s.points, s.closed, e.planar());
  e.require(curve->error().empty(), curve->error());
  if (!e.good()) return e.done();
  if (e.planar())
    Enter<1>(e, std::move(curve));
  else
    Enter<2>(e, std::move(curve));
  return e.done();
}

} // namespace hhtdae
