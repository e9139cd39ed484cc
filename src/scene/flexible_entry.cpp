/* Adds flexible bodies, and the frames of their attachments, to the description of a scene. */
#include "attach.h"
#include <cmath>

namespace hhtdae
{

namespace
{

double RatioOf(const FlexibleBody &b, double frequency)
{
  for (const DampingBand &band : b.damping)
    if (!(frequency > band.below)) return band.ratio;
  return b.damping.empty() ? 0 : b.damping.back().ratio;
}

std::vector<double> Sized(const Eigen::VectorXd &x, PetscInt n)
{
  std::vector<double> y(n, 0);
  if (x.size() == n) std::copy(x.data(), x.data() + n, y.begin());
  return y;
}

bool SameColumns(const ModalBody &m)
{
  const PetscInt n = m.modes();
  bool           same = m.first.cols() == n;
  for (const auto &x : m.moment) same = same && x.cols() == n;
  const auto square = [n](const std::array<Eigen::MatrixXd, 6> &all) {
    return std::all_of(all.begin(), all.end(), [&](const Eigen::MatrixXd &x) { return x.rows() == all[0].rows() && x.cols() == x.rows() && (x.rows() == n || !x.size()); });
  };
  for (const auto &x : m.quadratic) same = same && ((x.rows() == n && x.cols() == n) || x.size() == 0);
  same = same && square(m.stiffening);
  for (const ModalAttachment &a : m.attachments) same = same && a.translation.cols() == n && a.rotation.cols() == n && square(a.stiffening);
  for (const ModalNode &a : m.nodes) same = same && a.translation.cols() == n && a.rotation.cols() == n && !a.stiffening[0].size();
  const auto gradient = [n](Eigen::Index columns) { return columns == n || columns == 0; };
  for (const ModalLoadCase &l : m.loads)
    same = same && l.modal.size() == n && l.moment_gradient.cols() == n && gradient(l.force_gradient.cols()) && gradient(l.modal_gradient.cols()) &&
           l.modal_gradient.rows() == l.modal_gradient.cols();
  return same;
}

bool Finite(const ModalBody &m)
{
  bool good = m.omega.allFinite() && m.first.allFinite() && m.moments.allFinite() && m.center.allFinite();
  for (const auto &x : m.moment) good = good && x.allFinite();
  for (std::size_t p = 0; p < 6; p++) good = good && m.quadratic[p].allFinite() && m.stiffening[p].allFinite();
  for (const ModalAttachment &a : m.attachments) {
    good = good && a.position.allFinite() && a.translation.allFinite() && a.rotation.allFinite();
    for (const auto &x : a.stiffening) good = good && x.allFinite();
  }
  for (const ModalNode &a : m.nodes) good = good && a.position.allFinite() && a.translation.allFinite() && a.rotation.allFinite();
  for (const ModalLoadCase &l : m.loads)
    good = good && l.force.allFinite() && l.moment.allFinite() && l.modal.allFinite() && l.moment_gradient.allFinite() && l.force_gradient.allFinite() &&
           l.modal_gradient.allFinite();
  return good;
}

/* Largest coupling of a mode with rigid motion, relative to mass and size. A constant mass matrix (ModalMass::Constant) neglects it */
double RigidContent(const ModalBody &m)
{
  const double size = std::sqrt(m.moments.trace() / m.mass), scale = std::sqrt(m.mass);
  double       largest = m.first.size() ? m.first.cwiseAbs().maxCoeff() / scale : 0;
  for (int c = 0; c < 3 && m.modes(); c++) {
    const int d = (c + 1) % 3;
    largest     = std::max(largest, (m.moment[c].row(d) - m.moment[d].row(c)).cwiseAbs().maxCoeff() / (scale * size));
  }
  return largest;
}

/* What is wrong with the model, as text; empty if nothing */
std::string FaultOfModel(const FlexibleBody &b, bool planar)
{
  if (!b.model) return "it has no model; give a ModalBody";
  const ModalBody &m = *b.model;
  const PetscInt   n = m.modes();
  if (planar) return "flexible bodies need a scene in space";
  if (!SameColumns(m)) return "its ModalBody has " + std::to_string(n) + " frequencies, and invariants, attachments, nodes or loads with another number of modes";
  if (!Finite(m)) return "its ModalBody has values that are not finite";
  if (!(m.mass > 0 && m.moments.trace() > 0)) return "its ModalBody has a mass of " + Show(m.mass) + " and second moments of mass of " + Show(m.moments.trace()) + " in all; both are positive";
  if (n && m.omega.minCoeff() <= 0) return "mode " + std::to_string(n) + " or another has no positive frequency; rigid-body modes do not belong to a ModalBody";
  for (const auto &x : m.quadratic)
    if (n && !x.size() && b.mass == ModalMass::Full) return "its ModalBody has no invariants quadratic in the modes; use ModalMass::Partial or Constant";
  if (b.mass == ModalMass::Constant && RigidContent(m) > 1e-6)
    return "its modes move the centre of mass or turn the body as a whole; a constant mass matrix needs modes that are free of that";
  return "";
}

/* What is wrong with the other data; called only if nothing is wrong with the model */
std::string FaultOfValues(const FlexibleBody &b)
{
  const PetscInt n = b.model->modes();
  for (const Eigen::VectorXd *x : {&b.ratios, &b.deformation, &b.deformation_rate})
    if (x->size() && x->size() != n) return "it has " + std::to_string(n) + " modes, and damping ratios or a deformation of " + std::to_string(x->size());
  if (!b.deformation.allFinite() || !b.deformation_rate.allFinite()) return "its deformation at the start is not finite";
  for (std::size_t k = 0; k < b.damping.size(); k++) {
    const DampingBand &d = b.damping[k];
    if (!(d.ratio >= 0) || !std::isfinite(d.ratio)) return "a damping ratio is negative or not finite";
    if (!(k ? d.below > b.damping[k - 1].below : d.below >= 0))
      return "its bands of damping end at " + (k ? Show(b.damping[k - 1].below) + " and then at " : std::string()) + Show(d.below) + "; they have to be given by increasing frequency";
  }
  if (b.ratios.size() && !(b.ratios.minCoeff() >= 0 && b.ratios.allFinite())) return "a damping ratio is negative or not finite";
  return "";
}

} // namespace

Eigen::VectorXd ModalDamping(const FlexibleData &f)
{
  return 2 * Eigen::Map<const Eigen::VectorXd>(f.damping.data(), f.damping.size()).cwiseProduct(f.model->omega);
}

Body Scene::add(const std::string &name, const FlexibleBody &b)
{
  if (recording()) record([=](Scene &s) { s.add(name, b); });
  const std::string who = name.empty() ? "body " + std::to_string(data().bodies.size()) : name, wrong_model = FaultOfModel(b, data().planar),
                    fault = wrong_model.empty() ? FaultOfValues(b) : wrong_model;
  RigidBody         r;
  r.rotation         = b.rotation;
  r.velocity         = b.velocity;
  r.angular_velocity = b.angular_velocity;
  r.position         = b.position;
  r.fixed_start      = b.fixed_start;
  if (b.model) {
    r.mass    = b.model->mass;
    r.inertia = b.model->inertia();
    r.center  = b.model->center;
  }
  const Body body = addRigid(who, r);
  if (!fault.empty()) data().errors.push_back("flexible body " + who + ": " + fault);
  /* with a valid model the body is added as a flexible one in spite of other errors, so that calls that refer to its
     modes cause no further errors */
  if (!wrong_model.empty()) return body;
  auto           f = std::make_shared<FlexibleData>();
  const PetscInt n = b.model->modes();
  f->model            = b.model;
  f->mass             = b.mass;
  f->deformation      = Sized(b.deformation, n);
  f->deformation_rate = Sized(b.deformation_rate, n);
  for (PetscInt k = 0; k < n; k++) f->damping.push_back(b.ratios.size() == n && n ? b.ratios(k) : RatioOf(b, b.model->omega(k) / (2 * M_PI)));
  f->frame = (PetscInt)data().markers.size();
  data().markers.push_back({body.id, Vector3::Zero(), Matrix3::Identity()});
  data().bodies[body.id].flexible = f;
  return body;
}

Body Scene::attachment(Body body, const std::string &name)
{
  if (recording()) record([=](Scene &s) { s.attachment(body, name); });
  SceneData &s = data();
  const bool good = s.valid(body) && s.bodies[body.id].flexible;
  if (!good) {
    s.errors.push_back("attachment " + name + ": its body is not a flexible one of this scene");
    return Body{};
  }
  const ModalBody &m = *s.bodies[body.id].flexible->model;
  const PetscInt   a = m.attachment(name);
  if (a < 0) {
    std::string known;
    for (const ModalAttachment &x : m.attachments) known += (known.empty() ? "" : ", ") + x.name;
    s.errors.push_back("flexible body " + s.bodies[body.id].name + ": it has no attachment " + name + (known.empty() ? ", in fact none" : ", but " + known));
    return Body{};
  }
  return frameAt(body, a);
}

Body Scene::node(Body body, PetscInt label)
{
  if (recording()) record([=](Scene &s) { s.node(body, label); });
  SceneData        &s   = data();
  const std::string who = "node " + std::to_string(label);
  if (!s.valid(body) || !s.bodies[body.id].flexible) {
    s.errors.push_back(who + ": its body is not a flexible one of this scene");
    return Body{};
  }
  const ModalBody &m = *s.bodies[body.id].flexible->model;
  const PetscInt   n = m.node(label);
  if (n < 0) {
    s.errors.push_back("flexible body " + s.bodies[body.id].name + ": its model has not kept " + who + ", but " + std::to_string(m.nodes.size()) +
                       " others; keep it when the body is reduced (Reduction::node_sets, hhtreduce -keep_nodes)");
    return Body{};
  }
  return frameAt(body, (PetscInt)m.attachments.size() + n);
}

Body Scene::frameAt(Body body, PetscInt place)
{
  const SceneData &s = data();
  for (std::size_t b = 0; b < s.bodies.size(); b++)
    if (s.bodies[b].carrier == body.id && s.bodies[b].attachment == place) return Body{(PetscInt)b, s.number};
  return addFrame(body, place);
}

/* Adds the frame of attachment or node a; initially the frame is at the deformed position of its point */
Body Scene::addFrame(Body body, PetscInt a)
{
  SceneData             &s = data();
  const BodyData        &b = s.bodies[body.id];
  const ModalAttachment &x = b.flexible->place(a);
  const PetscInt         k = a - (PetscInt)b.flexible->model->attachments.size(); /* number of the node; negative for an attachment */
  const PetscInt         n = b.flexible->model->modes();
  const Eigen::Map<const Eigen::VectorXd> eta(b.flexible->deformation.data(), n), rate(b.flexible->deformation_rate.data(), n);
  const AttachedPoint point(x, eta);
  const Vector3   place = x.position - b.center, arm = place + point.motion.head<3>();
  const SmallTurn turn(point.motion.tail<3>());
  BodyData        f;
  f.name        = b.name + "." + (k < 0 ? x.name : "node " + std::to_string(b.flexible->model->nodes[k].label));
  f.mass        = 0;
  f.inertia     = Matrix3::Zero();
  f.center      = Vector3::Zero();
  f.A           = b.A * turn.rotation();
  f.r           = b.r + b.A * arm;
  f.v           = b.v + b.w.cross(b.A * arm) + b.A * (point.by_modes.topRows<3>() * rate);
  f.w           = b.w + b.A * (turn.J() * (point.by_modes.bottomRows<3>() * rate));
  f.fixed_start = b.fixed_start;
  f.massless      = true;
  f.light_mass    = 1e-3 * b.mass;
  f.light_inertia = 1e-3 * b.inertia.trace();
  f.carrier     = body.id;
  f.attachment  = a;
  f.forces_alone = k >= 0 && !b.flexible->model->nodes[k].turns;
  s.bodies.push_back(f);
  const Body frame{(PetscInt)s.bodies.size() - 1, s.number};
  s.markers.push_back({body.id, place, Matrix3::Identity()});
  s.markers.push_back({frame.id, Vector3::Zero(), Matrix3::Identity()});
  const Marker   i{(PetscInt)s.markers.size() - 2}, j{(PetscInt)s.markers.size() - 1};
  ElementBuilder e(*this, s.bodies[frame.id].name, "attachment", ElementData::Joint, i, j);
  AttachStore::Item item;
  item.marker[0] = i.id;
  item.marker[1] = j.id;
  e.put<AttachStore>(item);
  e.done();
  return frame;
}

} // namespace hhtdae
