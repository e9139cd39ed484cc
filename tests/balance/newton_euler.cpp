#include "balance/newton_euler.h"
#include <algorithm>

namespace hhtest
{

using namespace hhtdae;

namespace
{

bool Attaches(const ElementData &e) { return std::string(e.type) == "attachment"; }

} // namespace

NewtonEuler::NewtonEuler(Scene &scene, const Specs &specs)
    : scene_(scene), specs_(specs), origin_(scene.marker(scene.ground()))
{
  const PetscInt bodies = (PetscInt)DataOf(scene).bodies.size(), elements = (PetscInt)DataOf(scene).elements.size();
  body_.resize((std::size_t)bodies);
  element_.resize((std::size_t)elements);
  for (PetscInt b = 0; b < bodies; b++) look(b);
  for (PetscInt e = 0; e < elements; e++) lookAt(e);
  for (const BodyData &b : DataOf(scene).bodies)
    if (b.flexible) return;
  kinetic_ = scene.channel("balance kinetic", Measure::kineticEnergy()).id;
}

/* Adds channels of the components 0, 1, 2; returns the index of the first */
template <class Make> int NewtonEuler::three(const Make &make)
{
  const int first = (int)DataOf(scene_).channels.size();
  for (int c = 0; c < 3; c++) scene_.channel("balance " + std::to_string(first + c), make(c));
  return first;
}

void NewtonEuler::look(PetscInt b)
{
  const BodyData data = DataOf(scene_).bodies[(std::size_t)b]; /* a copy: markers are added below */
  OfBody        &k    = body_[(std::size_t)b];
  k.judged            = !data.flexible;
  if (!k.judged) return;
  k.moments       = !data.point && !data.massless;
  const Marker cm = scene_.marker(Body{b}, data.center);
  k.position      = three([&](int c) { return Measure::displacement(cm, c); });
  k.velocity      = three([&](int c) { return Measure::velocity(cm, c); });
  k.acceleration  = three([&](int c) { return Measure::acceleration(cm, c); });
  if (data.point) return;
  for (int axis = 0; axis < 2; axis++) {
    const Marker tip = scene_.marker(Body{b}, data.center + Vector3::Unit(axis));
    k.axis[axis]     = three([&](int c) { return Measure::displacement(tip, c, cm); });
  }
  k.spin    = three([&](int c) { return Measure::angularVelocity(cm, c); });
  k.turning = three([&](int c) { return Measure::angularAcceleration(cm, c); });
}

/* An element whose loads are unknown: none of its bodies is judged */
void NewtonEuler::leaveOut(PetscInt element)
{
  const SceneData &s = DataOf(scene_);
  unknown_.push_back(s.elements[(std::size_t)element].type);
  for (const Part &p : s.elements[(std::size_t)element].parts)
    for (int k = 0; k < p.store->markers(); k++) {
      const PetscInt b = s.markers[(std::size_t)p.store->marker(p.index, k)].body;
      if (b >= 0) body_[(std::size_t)b].judged = false;
    }
}

void NewtonEuler::lookAt(PetscInt element)
{
  const SceneData   &s = DataOf(scene_);
  const ElementData &e = s.elements[(std::size_t)element];
  OfElement         &k = element_[(std::size_t)element];
  k.known              = ElementLoads::known(s, specs_, element) || Attaches(e);
  if (!k.known) return leaveOut(element);
  k.component = (int)s.channels.size();
  if (Attaches(e) || ElementLoads::couples(s, element)) {
    k.components = Attaches(e) ? 3 : 1;
    for (int c = 0; c < k.components; c++)
      scene_.channel("balance " + std::to_string(k.component + c), Measure::multiplier(Element{element}, c));
  } else if (e.kind == ElementData::Force) {
    for (const Part &p : e.parts) k.components += p.store->rows();
    for (int c = 0; c < k.components; c++)
      scene_.channel("balance " + std::to_string(k.component + c), Measure::force(Element{element}, c));
  } else {
    k.force  = three([&](int c) { return Measure::jointForce(Element{element}, c, origin_); });
    k.moment = three([&](int c) { return Measure::jointMoment(Element{element}, c, origin_); });
  }
}

Vector3 NewtonEuler::read(const std::vector<double> &values, int first) const
{
  return first < 0
             ? Vector3(Vector3::Zero())
             : Vector3(values[(std::size_t)first], values[(std::size_t)first + 1], values[(std::size_t)first + 2]);
}

std::vector<Pose> NewtonEuler::poses(const std::vector<double> &values) const
{
  std::vector<Pose> all;
  for (const OfBody &k : body_) {
    Pose p;
    p.r = read(values, k.position);
    p.v = read(values, k.velocity);
    p.a = read(values, k.acceleration);
    if (k.spin >= 0) {
      p.A.col(0) = read(values, k.axis[0]);
      p.A.col(1) = read(values, k.axis[1]);
      p.A.col(2) = p.A.col(0).cross(p.A.col(1));
      p.w        = read(values, k.spin);
      p.alpha    = read(values, k.turning);
    }
    all.push_back(p);
  }
  return all;
}

std::vector<std::vector<Load>> NewtonEuler::loads(const std::vector<double> &values,
                                                  const std::vector<Pose>   &pose) const
{
  const SceneData               &s = DataOf(scene_);
  const ElementLoads             of(s, specs_, pose);
  std::vector<std::vector<Load>> all(element_.size());
  for (std::size_t e = 0; e < element_.size(); e++) {
    const OfElement &k = element_[e];
    if (!k.known) continue;
    Reading r;
    r.force  = read(values, k.force);
    r.moment = read(values, k.moment);
    for (int c = 0; c < k.components; c++) r.component.push_back(values[(std::size_t)(k.component + c)]);
    if (!Attaches(s.elements[e])) {
      of.add((PetscInt)e, r, all[e]);
      continue;
    }
    const PetscInt frame = s.markers[(std::size_t)s.elements[e].j.id].body;
    const PetscInt on =
        frame >= 0 && s.bodies[(std::size_t)frame].massless ? frame : s.markers[(std::size_t)s.elements[e].i.id].body;
    all[e].push_back({on, pose[(std::size_t)on].r, -read(values, k.component), Vector3::Zero()});
  }
  return all;
}

std::vector<BodyBalance> NewtonEuler::bodies(const std::vector<double> &values) const
{
  const SceneData         &s    = DataOf(scene_);
  const std::vector<Pose>  pose = poses(values);
  std::vector<BodyBalance> all(body_.size());
  for (std::size_t b = 0; b < body_.size(); b++) {
    const BodyData &d = s.bodies[b];
    BodyBalance    &k = all[b];
    k.body            = (PetscInt)b;
    if (d.massless || !body_[b].judged) continue;
    k.mass   = d.mass;
    k.force  = d.mass * (s.gravity - pose[b].a);
    k.forces = d.mass * (s.gravity.norm() + pose[b].a.norm());
    if (d.point) continue;
    Matrix3 I = d.inertia;
    if (s.planar) I = Vector3(0, 0, I(2, 2)).asDiagonal();
    const Matrix3 J    = pose[b].A * I * pose[b].A.transpose();
    const Vector3 rate = J * pose[b].alpha, gyro = pose[b].w.cross(J * pose[b].w);
    k.inertia = I.trace();
    k.moment  = -rate - gyro;
    k.moments = rate.norm() + pose[b].w.norm() * (J * pose[b].w).norm();
  }
  for (const auto &of : loads(values, pose))
    for (const Load &l : of) {
      if (l.body < 0) continue;
      BodyBalance  &k   = all[(std::size_t)l.body];
      const Vector3 arm = l.at - pose[(std::size_t)l.body].r;
      k.force += l.force;
      k.moment += l.moment + arm.cross(l.force);
      k.forces += l.force.norm();
      k.moments += l.moment.norm() + arm.norm() * l.force.norm();
    }
  for (std::size_t b = 0; b < body_.size(); b++) {
    if (!body_[b].judged) all[b] = BodyBalance{(PetscInt)b};
    if (!body_[b].moments) {
      all[b].moment.setZero();
      all[b].moments = 0;
    }
    if (!s.planar) continue;
    all[b].force(2) = all[b].moment(0) = all[b].moment(1) = 0;
  }
  return all;
}

/* The largest ratio of force or moment amounts to the loads on the body itself. If these are only rounding errors, the
   ratio is to 1e-9 of the largest loads on any body; for moments also to 1e-9 of the forces times the radius of
   gyration */
template <class Amounts> Imbalance NewtonEuler::largest(const std::vector<BodyBalance> &all, const Amounts &amounts) const
{
  Imbalance worst;
  double    force = 0, moment = 0;
  for (const BodyBalance &k : all) {
    force  = std::max(force, k.forces);
    moment = std::max(moment, k.moments);
  }
  const auto hold = [&](double missing, double sum, double least, const char *what, PetscInt body) {
    const double ratio = missing <= 0 ? 0 : missing / std::max(sum, 1e-9 * least);
    const double part  = std::isnan(ratio) ? INFINITY : ratio; /* NaN counts as larger than all others */
    if (part <= worst.largest) return;
    worst.largest = part;
    worst.where   = std::string(what) + " on " + DataOf(scene_).bodyName(body);
  };
  for (const BodyBalance &k : all) {
    const double                    gyration = k.mass > 0 ? std::sqrt(k.inertia / k.mass) : 0;
    const std::pair<double, double> missing  = amounts(k);
    hold(missing.first, k.forces, force, "force", k.body);
    /* moments that have decayed are rounding errors of forces times lever arms */
    hold(missing.second, std::max(k.moments, 1e-6 * gyration * k.forces), moment, "moment", k.body);
  }
  return worst;
}

BodyResidual NewtonEuler::residualOf(PetscInt body, const std::vector<BodyResidual> &left) const
{
  const OfBody &of = body_[(std::size_t)body];
  if (left.empty() || !of.judged) return {};
  BodyResidual r = left[(std::size_t)body];
  if (!of.moments) r.moment.setZero();
  return r;
}

Imbalance NewtonEuler::judge(const std::vector<double> &values, const std::vector<BodyResidual> &left) const
{
  Imbalance worst = largest(bodies(values), [&](const BodyBalance &k) {
    const BodyResidual r = residualOf(k.body, left);
    return std::make_pair((k.force + r.force).norm() - r.force_rounding, (k.moment + r.moment).norm() - r.moment_rounding);
  });
  if (kinetic_ >= 0) {
    const double own = kinetic(values), reported = values[(std::size_t)kinetic_], off = std::abs(own - reported);
    if (!(off <= worst.largest * own)) worst = {own > 0 ? off / own : 1, "kinetic energy of the scene"};
  }
  return worst;
}

Imbalance NewtonEuler::unsolved(const std::vector<double> &values, const std::vector<BodyResidual> &left) const
{
  return largest(bodies(values), [&](const BodyBalance &k) {
    const BodyResidual r = residualOf(k.body, left);
    return std::make_pair(r.force.norm() - r.force_allowed, r.moment.norm() - r.moment_allowed);
  });
}

Powers NewtonEuler::powers(const std::vector<double> &values) const
{
  const SceneData        &s    = DataOf(scene_);
  const std::vector<Pose> pose = poses(values);
  const auto              load = loads(values, pose);
  Powers                  p;
  for (std::size_t e = 0; e < load.size(); e++)
    for (const Load &l : load[e]) {
      if (l.body < 0) continue;
      const Pose   &b     = pose[(std::size_t)l.body];
      const Vector3 v     = b.v + b.w.cross(l.at - b.r);
      const double  power = l.force.dot(v) + l.moment.dot(b.w);
      const double  most =
          l.force.norm() * (b.v.norm() + b.w.norm() * (l.at - b.r).norm()) + l.moment.norm() * b.w.norm();
      p.absolute += most;
      if (s.elements[e].kind == ElementData::Force)
        p.forces += power;
      else if (s.elements[e].kind == ElementData::Motion)
        p.motions += power;
      else {
        p.joints += power;
        p.of_joints += most;
      }
    }
  for (std::size_t b = 0; b < pose.size(); b++) {
    const BodyData &d     = s.bodies[b];
    const double    power = d.massless || d.flexible ? 0 : d.mass * s.gravity.dot(pose[b].v);
    p.gravity += power;
    p.absolute += d.massless || d.flexible ? 0 : d.mass * s.gravity.norm() * pose[b].v.norm();
  }
  return p;
}

std::vector<double> NewtonEuler::magnitudes(const std::vector<double> &values) const
{
  std::vector<double> all;
  for (const auto &of : loads(values, poses(values))) {
    double most = 0;
    for (const Load &l : of) most = std::max({most, l.force.norm(), l.moment.norm()});
    all.push_back(most);
  }
  return all;
}

double NewtonEuler::kinetic(const std::vector<double> &values) const
{
  const SceneData        &s    = DataOf(scene_);
  const std::vector<Pose> pose = poses(values);
  double                  sum  = 0;
  for (std::size_t b = 0; b < pose.size(); b++) {
    const BodyData &d = s.bodies[b];
    if (d.massless || d.flexible) continue;
    sum += 0.5 * d.mass * pose[b].v.squaredNorm();
    if (d.point) continue;
    const Vector3 w = pose[b].A.transpose() * pose[b].w; /* about z only in a planar scene */
    sum += 0.5 * w.dot(d.inertia * w);
  }
  return sum;
}

int NewtonEuler::judged() const
{
  int n = 0;
  for (const OfBody &k : body_) n += k.judged;
  return n;
}

} // namespace hhtest
