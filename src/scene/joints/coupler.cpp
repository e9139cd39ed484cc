/* Couplers of joint motions: gear, rack and pinion, general coupler of two or three. */
#include "scene/kernels/coupler.h"
#include "scene/motions/moving_pair.h"
#include <algorithm>

namespace hhtdae
{

namespace
{

using Term  = Coupler::Term;
using Terms = std::vector<Term>;

void CheckTerm(ElementBuilder &e, const Term &t, std::size_t k)
{
  const std::string term = "term " + std::to_string(k + 1);
  e.require(t.i, (term + ": marker i").c_str());
  e.require(t.j, (term + ": marker j").c_str());
  e.require(std::isfinite(t.factor) && t.factor != 0,
            term + ": factor is " + Show(t.factor) + ", must be finite and not zero");
  if (e.good()) RequirePair(e, t.i, t.j, t.rotation, term + ": ");
}

/* Adds the coupler's row. In a planar scene translations are along x_j, since z is normal to the plane. */
template <int N, int R> void Constrain(ElementBuilder &e, const Terms &terms)
{
  using K = CouplerRow<N, R>;
  Frame<double>    f[2 * N];
  typename K::Data d;
  d.axis = e.planar() ? 0 : 2;
  for (int k = 0; k < N; k++) {
    f[2 * k]     = e.frame(terms[k].i);
    f[2 * k + 1] = e.frame(terms[k].j);
    d.factor[k]  = terms[k].factor;
  }
  K::begin(d, f);
  if constexpr (N == 2)
    e.constrain<K>({terms[0].i, terms[0].j, terms[1].i, terms[1].j}, d);
  else
    e.constrain<K>({terms[0].i, terms[0].j, terms[1].i, terms[1].j, terms[2].i, terms[2].j}, d);
}

/* Selects the kernel whose number of rotations R, which are the first terms, is `rotations` */
template <int N, int R = N> void Dispatch(ElementBuilder &e, const Terms &terms, int rotations)
{
  if (rotations == R)
    Constrain<N, R>(e, terms);
  else if constexpr (R > 0)
    Dispatch<N, R - 1>(e, terms, rotations);
}

Element Couple(ElementBuilder &e, Terms terms)
{
  for (std::size_t k = 0; k < terms.size(); k++) CheckTerm(e, terms[k], k);
  if (!e.good()) return e.done();
  std::stable_sort(terms.begin(), terms.end(), [](const Term &a, const Term &b) { return a.rotation && !b.rotation; });
  const int rotations = (int)std::count_if(terms.begin(), terms.end(), [](const Term &t) { return t.rotation; });
  if (terms.size() == 2)
    Dispatch<2>(e, terms, rotations);
  else
    Dispatch<3>(e, terms, rotations);
  return e.done();
}

} // namespace

/* Multiplier: moment on the first wheel's body about its z_j; the moment on the second wheel is ratio times the multiplier. */
template <> Element Scene::enter(const std::string &name, const Gear &s)
{
  ElementBuilder e(*this, name, "gear", ElementData::Joint, s.i1, s.j1);
  e.require(std::isfinite(s.ratio) && s.ratio != 0, "ratio is " + Show(s.ratio) + ", must be finite and not zero");
  if (!e.good()) return e.done();
  return Couple(e, {{s.i1, s.j1, true, 1}, {s.i2, s.j2, true, s.ratio}});
}

/* Multiplier: force on the rack's body; the moment on the pinion's body is -radius times the multiplier. */
template <> Element Scene::enter(const std::string &name, const RackAndPinion &s)
{
  ElementBuilder e(*this, name, "rack and pinion", ElementData::Joint, s.i1, s.j1);
  e.require(std::isfinite(s.radius) && s.radius != 0, "radius is " + Show(s.radius) + ", must be finite and not zero");
  if (!e.good()) return e.done();
  return Couple(e, {{s.i1, s.j1, true, -s.radius}, {s.i2, s.j2, false, 1}});
}

/* Multiplier: the load on the k-th joint divided by its factor, the same for all k. */
template <> Element Scene::enter(const std::string &name, const Coupler &s)
{
  const bool     some = !s.terms.empty();
  ElementBuilder e(*this, name, "coupler", ElementData::Joint, some ? s.terms[0].i : Marker{},
                   some ? s.terms[0].j : Marker{});
  e.require(s.terms.size() == 2 || s.terms.size() == 3,
            std::to_string(s.terms.size()) + " terms, must be two or three");
  if (!e.good()) return e.done();
  return Couple(e, s.terms);
}

} // namespace hhtdae
