/* Screw: a cylindrical joint whose advance and rotation are coupled. */
#include "scene/kernels/coupler.h"
#include "scene/kernels/primitives.h"
#include "scene/kernels/primitives_axes.h"
#include "scene/motions/moving_pair.h"

namespace hhtdae
{

/* Multipliers: force on i's body along j's x and y axes, moment about these axes, axial force. */
template <> Element Scene::enter(const std::string &name, const Screw &s)
{
  ElementBuilder e(*this, name, "screw", ElementData::Joint, s.i, s.j);
  e.require(!e.planar(), "a planar scene has no screws");
  e.require(std::isfinite(s.pitch), "pitch is " + Show(s.pitch) + ", must be finite");
  if (e.good()) RequirePair(e, s.i, s.j, true);
  if (e.good()) {
    const Frame<double> f[2] = {e.frame(s.i), e.frame(s.j)};
    ScrewRow::Data      d;
    d.pitch = s.pitch;
    ScrewRow::begin(d, f);
    e.constrain<OnLine>({s.i, s.j});
    e.constrain<Parallel>({s.i, s.j}, Parallel::branch(f[0], f[1]));
    e.constrain<ScrewRow>({s.i, s.j}, d);
  }
  return e.done();
}

} // namespace hhtdae
