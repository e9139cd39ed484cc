/* Contacts for tests: contact laws, random shapes that touch, and the force between them */
#ifndef HHTDAE_TEST_CONTACT_CASES_H
#define HHTDAE_TEST_CONTACT_CASES_H

#include "kernel_checks.h"
#include "scene/kernels/contact.h"

namespace hhtdae
{

inline ContactLaw MakeLaw(double k, double e, double c, double mu, double vs)
{
  ContactLaw law;
  law.stiffness     = k;
  law.exponent      = e;
  law.damping       = c;
  law.friction      = mu;
  law.slip_velocity = vs;
  return law;
}

inline ContactLaw SomeLaw(Random &random)
{
  const double exponents[] = {1, 1.5, 2, 2.2};
  const double e           = exponents[(int)random(0, 3.999)];
  return MakeLaw(random(1, 5), e, random(0, .5), random(0, 1), random(.5, 2));
}

/* Random shapes; in place(): random frames in which they touch with penetrations between .05 and .3 */
template <class Shape> struct Make;

template <class Shape> void Press(const typename Shape::Data &d, Frame<double> *f, double depth)
{
  Touch<double> t;
  Shape::template touch<double>(d, f, t);
  f[0].x += t.n * (t.depth - depth);
}

template <> struct Make<SpherePlaneShape> {
  static SpherePlaneShape::Data data(Random &r) { return {r(.5, 2), r(0, 1) < .5 ? 1 : 2}; }
};
template <> struct Make<EllipsoidPlaneShape> {
  static EllipsoidPlaneShape::Data data(Random &r) { return {{r(.5, 2), r(.5, 2), r(.5, 2)}, r(0, 1) < .5 ? 1 : 2}; }
};
template <> struct Make<TorusPlaneShape> {
  static TorusPlaneShape::Data data(Random &r) { return {r(.5, 2), r(.1, .5)}; }
};
template <> struct Make<SphereSphereShape> {
  static SphereSphereShape::Data data(Random &r) { return {r(.5, 2), r(.5, 2)}; }
};
template <> struct Make<SphereBoxShape> {
  static SphereBoxShape::Data data(Random &r) { return {r(.8, 2), {r(.5, 2), r(.5, 2), r(.5, 2)}}; }
};

/* Places the sphere so that the box's nearest point is on a face, an edge or a corner, away from the borders between
   these regions, where the normal has a kink */
template <class Shape> void PutSomewhere(const typename Shape::Data &, Random &, Frame<double> *) {}
template <> inline void     PutSomewhere<SphereBoxShape>(const SphereBoxShape::Data &d, Random &random, Frame<double> *f)
{
  const int    region = 1 + (int)random(0, 6.999); /* one bit for each axis along which the centre is outside the box */
  Vec3<double> c;
  for (int k = 0; k < 3; k++) {
    const double sign = random(-1, 1) < 0 ? -1 : 1;
    c(k)              = sign * (region >> k & 1 ? d.half[k] + random(.5, 1) : d.half[k] * random(0, .9));
  }
  f[0].x = f[1].x + f[1].R * c;
}

template <class Shape> typename Contact<Shape>::Data Touching(Random &random, Frame<double> *f)
{
  typename Contact<Shape>::Data d{Make<Shape>::data(random), SomeLaw(random)};
  PutSomewhere<Shape>(d.shape, random, f);
  Press<Shape>(d.shape, f, random(.05, .3));
  return d;
}

template <class Shape> struct Encounter {
  Frame<double>                 f[2];
  Twist<double>                 w[2];
  typename Contact<Shape>::Data d;
  explicit Encounter(Random &random)
  {
    for (int k = 0; k < 2; k++) {
      f[k] = random.frame();
      w[k] = random.twist();
    }
    d = Touching<Shape>(random, f);
  }
  Touch<double> touch() const
  {
    Touch<double> t;
    Shape::template touch<double>(d.shape, f, t);
    return t;
  }
  double rate(const Touch<double> &t) const { return -t.n.dot(Contact<Shape>::template slip<double>(f, w, t.p)); }
  double power() const
  {
    Wrench<double> on[2];
    Contact<Shape>::wrench(d, f, w, 0, nullptr, on);
    double p = 0;
    for (int k = 0; k < 2; k++) p += on[k].f.dot(w[k].v) + on[k].m.dot(w[k].w);
    return p;
  }
  /* penetration after the frames have moved along their twists for a time h */
  DynamicVector depthAfter(double h) const
  {
    Encounter moved(*this);
    moved.advance(h);
    return DynamicVector::Constant(1, moved.touch().depth);
  }
  DynamicVector energyAfter(double h) const
  {
    Encounter moved(*this);
    moved.advance(h);
    return DynamicVector::Constant(1, Contact<Shape>::energy(d, moved.f));
  }

private:
  void advance(double h)
  {
    for (int k = 0; k < 2; k++) {
      f[k].x += h * w[k].v;
      f[k].R = Eigen::AngleAxisd(h * w[k].w.norm(), w[k].w.normalized()).toRotationMatrix() * f[k].R;
    }
  }
};

inline const Mat3<double>  upright = Mat3<double>::Identity();
inline const Frame<double> origin{Vec3<double>::Zero(), upright};
inline const Twist<double> rest{Vec3<double>::Zero(), Vec3<double>::Zero()};

} // namespace hhtdae

#endif
