#include "projection.h"
#include <petscblaslapack.h>

namespace hhtdae
{

namespace
{

using Wide = Eigen::Matrix<double, Eigen::Dynamic, 6>;

constexpr double asymmetry_tolerance = 1e-12; /* relative to the largest entry; smaller asymmetries are rounding, which loads with a potential have */

Carrier       &CarrierOf(Bodies &B, PetscInt frame) { return B.carriers[B.body[frame].carrier]; }
const Carrier &CarrierOf(const Bodies &B, PetscInt frame) { return B.carriers[B.body[frame].carrier]; }

/* Transforms columns (x, theta, v, w, a, alpha) of a frame to columns of its body's position and angles (`rigid`), of the
   attachment's (xi, phi) (`motion`), and of B eta' and B eta'' (`bend`) */
struct ByBody {
  Wide rigid, motion, bend[2];

  template <class In> ByBody(const In &X, const FrameGradient &g, double sv, double sa, bool bends)
  {
    const int groups = (int)X.cols() / 3;
    rigid.resize(X.rows(), 6);
    motion.resize(X.rows(), 6);
    rigid.leftCols<3>()   = X.template leftCols<3>();
    rigid.rightCols<3>()  = X.template leftCols<3>().lazyProduct(g.angles[0]) + X.template middleCols<3>(3).lazyProduct(g.angles[1]);
    motion.leftCols<3>()  = X.template leftCols<3>().lazyProduct(g.motion[0]);
    motion.rightCols<3>() = X.template middleCols<3>(3).lazyProduct(g.motion[1]);
    for (int i = 2; i < groups; i++) {
      const auto by = X.template middleCols<3>(3 * i);
      if (i % 2 == 0) rigid.leftCols<3>() += (i == 2 ? sv : sa) * by;
      rigid.rightCols<3>() += by.lazyProduct(g.angles[i]);
      motion.middleCols<3>(3 * (i % 2)) += by.lazyProduct(g.motion[i]);
    }
    for (int b = 0; b < 2 && bends && groups > 2 + 2 * b; b++) {
      bend[b].setZero(X.rows(), 6);
      for (int i = 2 + 2 * b; i < groups; i++) bend[b].middleCols<3>(3 * (i % 2)) += X.template middleCols<3>(3 * i).lazyProduct(b ? g.bend_rate[i] : g.bend[i]);
    }
  }
};

/* Transforms rows (force, moment) on a frame to six rows of its body's position and angles, and six rows of the attachment's (xi, phi) */
template <class In> Eigen::Matrix<double, 12, Eigen::Dynamic> ToBody(const Bodies &B, PetscInt frame, const In &Y)
{
  const Carrier                            &c = CarrierOf(B, frame);
  const Carrier::Attached                  &f = c.attached[B.body[frame].place];
  const BodyMotion                         &b = B.now[c.body];
  Eigen::Matrix<double, 12, Eigen::Dynamic> out(12, Y.cols());
  const auto                                force = Y.topRows(3), moment = Y.bottomRows(3);
  out.topRows(3)       = force;
  out.middleRows(3, 3) = Matrix3(b.G.transpose()).lazyProduct(Cross<double>(f.arm).lazyProduct(force) + moment);
  out.middleRows(6, 3) = Matrix3(b.A.transpose()).lazyProduct(force);
  out.bottomRows(3)    = Matrix3((b.A * f.turn.J()).transpose()).lazyProduct(moment);
  return out;
}

/* y += A B, or A B^T if `transposed` */
void AddProduct(const Eigen::MatrixXd &A, const Eigen::MatrixXd &B, bool transposed, Eigen::Ref<Eigen::MatrixXd> y)
{
  const PetscBLASInt m = (PetscBLASInt)y.rows(), n = (PetscBLASInt)y.cols(), k = (PetscBLASInt)A.cols(), lda = (PetscBLASInt)A.outerStride(),
                     ldb = (PetscBLASInt)B.outerStride(), ldy = (PetscBLASInt)y.outerStride();
  const double one = 1;
  if (m && n && k) BLASgemm_("N", transposed ? "T" : "N", &m, &n, &k, &one, A.data(), &lda, B.data(), &ldb, &one, y.data(), &ldy);
}

} // namespace

void Projection::pattern(Pattern &p, const Bodies &B)
{
  std::map<std::pair<PetscInt, PetscInt>, std::size_t> found;
  carriers_ = B.carriers.size();
  if (!carriers_) return;
  const auto own = [&](PetscInt row) { return p.group[row].frame >= 0 ? B.body[p.group[row].frame].owned : p.group[row].own; };
  const auto key = [&](PetscInt g) { return p.group[g].frame >= 0 ? p.group[g].frame : -1 - g; };
  p.ofFrames([&](PetscInt, PetscInt row, PetscInt column) {
    if (!own(row)) return;
    const Group &r = p.group[row], &c = p.group[column];
    const auto   at = found.emplace(std::make_pair(key(row), key(column)), pairs_.size());
    if (at.second) pairs_.emplace_back();
    Pair &x        = pairs_[at.first->second];
    x.row_frame    = r.frame;
    x.column_frame = c.frame;
    x.row_group    = row;
    x.column_group = column;
    x.rows         = r.frame >= 0 ? 6 : r.size;
    x.columns      = c.frame >= 0 ? std::max<PetscInt>(x.columns, 6 * (c.at / 6 + 1)) : c.size;
  });
  std::size_t size = 0;
  for (Pair &x : pairs_) {
    x.at = size;
    size += (std::size_t)(x.rows * x.columns);
    accelerations_ = accelerations_ || (x.column_frame >= 0 && x.columns > 12);
  }
  array_.assign(size, 0);
  p.ofFrames([&](PetscInt number, PetscInt row, PetscInt column) {
    if (!own(row)) return;
    const Pair &x = pairs_[found[{key(row), key(column)}]];
    Slot        s;
    s.base   = (PetscInt)x.at + p.group[row].at * x.columns + p.group[column].at;
    s.stride = x.columns;
    s.frame  = true;
    of_.push_back({number, s});
  });
  const auto groups = [&](PetscInt frame, PetscInt group) {
    std::vector<PetscInt> all{group};
    if (frame < 0) return all;
    const PetscInt first = B.body[CarrierOf(B, frame).body].group;
    all                  = {first, first + 1, first + 2};
    return all;
  };
  cores_.resize(carriers_);
  const auto couple = [&](PetscInt carrier, int k, int l) {
    Core &c = cores_[carrier];
    if (c.place.emplace(std::make_pair(k, l), c.motion.size()).second) c.motion.emplace_back();
  };
  for (std::size_t c = 0; c < carriers_; c++)
    for (int k = 0; k < B.carriers[c].count(); k++) couple((PetscInt)c, k, k);
  for (Pair &x : pairs_) {
    x.first = request_.size();
    if (x.row_frame >= 0 && x.column_frame >= 0 && B.body[x.row_frame].carrier == B.body[x.column_frame].carrier) {
      const LocalBody &r = B.body[x.row_frame], &c = B.body[x.column_frame];
      couple(r.carrier, (int)r.place, (int)c.place);
      couple(r.carrier, (int)c.place, (int)r.place);
      continue;
    }
    for (PetscInt r : groups(x.row_frame, x.row_group))
      for (PetscInt c : groups(x.column_frame, x.column_group)) request_.push_back(p.need(r, c));
  }
}

void Projection::resolve(Pattern &p)
{
  for (const auto &x : of_) p.put(x.first, x.second);
  slot_.resize(request_.size());
  for (std::size_t i = 0; i < request_.size(); i++) slot_[i] = p.slot(request_[i]);
  std::vector<PetscInt>().swap(request_);
  std::vector<std::pair<PetscInt, Slot>>().swap(of_);
}

void Projection::begin(Sink &s)
{
  std::fill(array_.begin(), array_.end(), 0.0);
  s.frame = array_.data();
}

void Projection::finish(Evaluation &e)
{
  Bodies &B = e.bodies;
  for (std::size_t c = 0; c < carriers_; c++) {
    B.carriers[c].linearize(B, e.v, e.a, e.sv, e.sa, accelerations_);
    if (B.body[B.carriers[c].body].owned) geometric(e, c);
  }
  for (const Pair &p : pairs_) {
    if (p.row_frame < 0) addColumns(e, p);
    else if (p.column_frame < 0) addRows(e, p);
    else if (B.body[p.row_frame].carrier == B.body[p.column_frame].carrier) collect(e, p);
    else addBoth(e, p);
  }
  for (std::size_t c = 0; c < carriers_; c++)
    if (B.body[B.carriers[c].body].owned) deliver(e, c);
}

/* Sets the Core of a body to d(L^T (f, m))/dq for loads on the frames that stay fixed in space. Bodies::modalJacobian()
   adds d(G^T m)/dq for the sum m of all moments */
void Projection::geometric(const Evaluation &e, std::size_t carrier)
{
  const Bodies     &B    = e.bodies;
  const Carrier    &c    = B.carriers[carrier];
  const BodyMotion &b    = B.now[c.body];
  Core             &core = cores_[carrier];
  const int         n    = c.count();
  core.rigid.setZero();
  core.rigid_motion.setZero(6, 6 * n);
  core.motion_rigid.setZero(6 * n, 6);
  for (Matrix<6, 6> &x : core.motion) x.setZero();
  for (int k = 0; k < 2; k++) core.bends[k] = false;
  for (int k = 0; k < n; k++) {
    const Carrier::Attached &f = c.attached[k];
    const BodyMotion        &i = B.now[f.body];
    const Matrix3            F = Cross<double>(i.f), G = f.gradient.angles[1], J = f.turn.J();
    const int                x = c.column(k, 0), phi = c.column(k, 1);
    core.rigid.bottomRightCorner<3, 3>() -= b.G.transpose() * F * Cross<double>(f.arm) * G;
    core.rigid_motion.block<3, 3>(3, x)                          = b.G.transpose() * F * b.A;
    core.motion_rigid.block<3, 3>(x, 3)                          = -b.A.transpose() * F * G;
    core.motion_rigid.block<3, 3>(phi, 3)                        = -(b.A * J).transpose() * Cross<double>(i.m) * G;
    core.motion[core.place.at({k, k})].bottomRightCorner<3, 3>() = -f.turn.momentGradient(b.A.transpose() * i.m);
  }
}

/* For rows of a group of unknowns and columns of a frame: adds to the columns of the body's position, angles and modes */
void Projection::addColumns(Evaluation &e, const Pair &p)
{
  const Carrier &c = CarrierOf(e.bodies, p.column_frame);
  const int      k = (int)e.bodies.body[p.column_frame].place;
  const Slot    *s = &slot_[p.first];
  const ByBody   D(block(p), c.attached[k].gradient, e.sv, e.sa, c.stiffens());
  e.sink.add(s[0], D.rigid, (int)p.rows, 3);
  e.sink.add(s[1], D.rigid.rightCols<3>(), (int)p.rows, 3);
  addModalColumns(e, s[2], c, k, D.motion, D.bend);
}

/* wide_ = W times the transposed shapes of attachment k; with `more` this is added to wide_ */
void Projection::byModes(const Eigen::MatrixXd &shapes, const Carrier &c, int k, const Wide &W, int m, bool more)
{
  const auto x = shapes.middleCols<3>(c.column(k, 0)), y = shapes.middleCols<3>(c.column(k, 1));
  if (!more) wide_.resize(W.rows(), m);
  for (Eigen::Index r = 0; r < W.rows(); r++) {
    const auto row = (W(r, 0) * x.col(0).head(m) + W(r, 1) * x.col(1).head(m) + W(r, 2) * x.col(2).head(m) + W(r, 3) * y.col(0).head(m) +
                      W(r, 4) * y.col(1).head(m) + W(r, 5) * y.col(2).head(m))
                         .transpose();
    if (more) wide_.row(r) += row;
    else wide_.row(r) = row;
  }
}

void Projection::addModalColumns(Evaluation &e, const Slot &s, const Carrier &c, int k, const Wide &by_motion, const Wide *by_bend)
{
  const int m = e.bodies.modes(c.body);
  if (s.base < 0 || !m) return;
  byModes(c.shapes, c, k, by_motion, m, false);
  for (int b = 0; b < 2; b++)
    if (by_bend[b].rows()) byModes(b ? c.bend_rate : c.bend, c, k, by_bend[b], m, true);
  e.sink.add(s, wide_, (int)wide_.rows(), m);
}

/* For rows of a frame and columns of a group of unknowns: adds to the rows of the body's position, angles and modes */
void Projection::addRows(Evaluation &e, const Pair &p)
{
  const Carrier &c = CarrierOf(e.bodies, p.row_frame);
  const int      k = (int)e.bodies.body[p.row_frame].place, m = e.bodies.modes(c.body), n = (int)p.columns;
  const Slot    *s = &slot_[p.first];
  const auto     Y = ToBody(e.bodies, p.row_frame, block(p));
  e.sink.add(s[0], Y.topRows(3), 3, n);
  e.sink.add(s[1], Y.middleRows(3, 3), 3, n);
  if (s[2].base < 0 || !m) return;
  byModes(c.shapes, c, k, Y.bottomRows<6>().transpose(), m, false);
  e.sink.add(s[2], wide_.transpose(), m, n);
}

/* For frames of two different bodies: adds to the rows of position, angles and modes of one body and the columns of the other */
void Projection::addBoth(Evaluation &e, const Pair &p)
{
  const Bodies   &B  = e.bodies;
  const Carrier  &cp = CarrierOf(B, p.row_frame), &cq = CarrierOf(B, p.column_frame);
  const int       kp = (int)B.body[p.row_frame].place, kq = (int)B.body[p.column_frame].place, m = B.modes(cp.body);
  const Slot     *s = &slot_[p.first];
  const ByBody    D(block(p), cq.attached[kq].gradient, e.sv, e.sa, cq.stiffens());
  const auto      rigid = ToBody(B, p.row_frame, D.rigid), motion = ToBody(B, p.row_frame, D.motion);
  Eigen::MatrixXd rows(6 + m, 12); /* rows of body p; columns: position and angles of body q, then (xi, phi) of frame q */
  const auto      modal = [&](const Eigen::MatrixXd &Y) {
    return Eigen::MatrixXd(cp.shapes.middleCols<3>(cp.column(kp, 0)).topRows(m) * Y.middleRows<3>(6) + cp.shapes.middleCols<3>(cp.column(kp, 1)).topRows(m) * Y.bottomRows<3>());
  };
  rows.topRows<6>() << rigid.topRows(6), motion.topRows(6);
  rows.bottomRows(m) << modal(rigid), modal(motion);
  Wide bend[2][3];
  for (int b = 0; b < 2; b++) {
    if (!D.bend[b].rows()) continue;
    const Eigen::MatrixXd Y = ToBody(B, p.row_frame, D.bend[b]);
    bend[b][0]              = Y.topRows(3);
    bend[b][1]              = Y.middleRows(3, 3);
    bend[b][2]              = modal(Y);
  }
  for (int g = 0; g < 3; g++) {
    const int  size  = g < 2 ? 3 : m;
    const auto of    = rows.middleRows(3 * g, size);
    const Wide by[2] = {bend[0][g], bend[1][g]};
    if (!size) continue;
    e.sink.add(s[3 * g], of.leftCols(3), size, 3);
    e.sink.add(s[3 * g + 1], of.middleCols(3, 3), size, 3);
    addModalColumns(e, s[3 * g + 2], cq, kq, Wide(of.rightCols(6)), by);
  }
}

/* For two frames of the same body: adds to the Core of the body */
void Projection::collect(const Evaluation &e, const Pair &p)
{
  const Bodies  &B    = e.bodies;
  const Carrier &c    = CarrierOf(B, p.row_frame);
  Core          &core = cores_[B.body[p.row_frame].carrier];
  const int      n = c.count(), row = (int)B.body[p.row_frame].place, column = (int)B.body[p.column_frame].place;
  const ByBody   D(block(p), c.attached[column].gradient, e.sv, e.sa, c.stiffens());
  const auto     rigid = ToBody(B, p.row_frame, D.rigid), motion = ToBody(B, p.row_frame, D.motion);
  core.rigid += rigid.topRows<6>();
  core.motion[core.place.at({row, column})] += motion.bottomRows<6>();
  for (int part = 0; part < 2; part++) {
    const int at = c.column(row, part), to = c.column(column, part);
    core.rigid_motion.middleCols<3>(to) += motion.topRows<6>().middleCols<3>(3 * part);
    core.motion_rigid.middleRows<3>(at) += rigid.middleRows<3>(6 + 3 * part);
  }
  for (int b = 0; b < 2; b++) {
    if (!D.bend[b].rows()) continue;
    if (!core.bends[b]) {
      core.rigid_bend[b].setZero(6, 6 * n);
      core.motion_bend[b].setZero(6 * n, 6 * n);
      core.bends[b] = true;
    }
    const auto Y = ToBody(B, p.row_frame, D.bend[b]);
    for (int part = 0; part < 2; part++) {
      core.rigid_bend[b].middleCols<3>(c.column(column, part)) += Y.topRows<6>().middleCols<3>(3 * part);
      for (int other = 0; other < 2; other++) core.motion_bend[b].block<3, 3>(c.column(row, other), c.column(column, part)) += Y.block<3, 3>(6 + 3 * other, 3 * part);
    }
  }
}

/* Transfers the Core of a body to its ModalPart. The symmetric part of the matrix between modes is added together with
   the invariants (ModalProducts::combine()), at half the cost; damping and other loads without a potential leave an
   unsymmetric part */
void Projection::deliver(Evaluation &e, std::size_t carrier)
{
  const Carrier &c    = e.bodies.carriers[carrier];
  const Core    &core = cores_[carrier];
  ModalPart     &p    = e.bodies.modal[e.bodies.body[c.body].modal];
  const int      m    = e.bodies.modes(c.body);
  p.rigid             = core.rigid;
  p.rigid_modal.setZero(m, 6);
  p.modal_rigid.setZero(m, 6);
  AddProduct(c.shapes, core.rigid_motion, true, p.rigid_modal);
  AddProduct(c.shapes, core.motion_rigid, false, p.modal_rigid);
  p.outer.left = c.shapes;
  p.outer.right.setZero(c.shapes.rows(), c.shapes.cols());
  for (const auto &x : core.place) {
    const Matrix<6, 6> D = 0.5 * (core.motion[x.second] + core.motion[core.place.at({x.first.second, x.first.first})].transpose());
    addTo(p.outer.right, c, x.first.first, x.first.second, D);
  }
  addUnsymmetric(c, core, p);
  if (c.stiffens()) c.stiffen(p.stiffening);
}

/* Adds shapes of attachment k times D to the columns of attachment l in `right` */
void Projection::addTo(Eigen::MatrixXd &right, const Carrier &c, int k, int l, const Matrix<6, 6> &D)
{
  for (int ends = 0; ends < 4; ends++) {
    const Matrix3 X  = D.block<3, 3>(3 * (ends / 2), 3 * (ends % 2));
    const auto    s  = c.shapes.middleCols<3>(c.column(k, ends / 2));
    const int     to = c.column(l, ends % 2);
    for (int i = 0; i < 3 && !X.isZero(0); i++) right.col(to + i) += X(0, i) * s.col(0) + X(1, i) * s.col(1) + X(2, i) * s.col(2);
  }
}

void Projection::addUnsymmetric(const Carrier &c, const Core &core, ModalPart &p)
{
  const Eigen::Index m       = p.rigid_modal.rows();
  double             largest = 0;
  std::vector<int>   used;
  p.unsymmetric.resize(0, 0);
  for (const Matrix<6, 6> &x : core.motion) largest = std::max(largest, x.cwiseAbs().maxCoeff());
  for (const auto &x : core.place) {
    const Matrix<6, 6> D = 0.5 * (core.motion[x.second] - core.motion[core.place.at({x.first.second, x.first.first})].transpose());
    if (D.cwiseAbs().maxCoeff() <= asymmetry_tolerance * largest) continue;
    if (used.empty()) right_.setZero(c.shapes.rows(), c.shapes.cols());
    addTo(right_, c, x.first.first, x.first.second, D);
    for (int i = 0; i < 6; i++) used.push_back(c.column(x.first.second, i / 3) + i % 3);
  }
  if (!used.empty()) {
    std::sort(used.begin(), used.end());
    used.erase(std::unique(used.begin(), used.end()), used.end());
    used.erase(std::remove_if(used.begin(), used.end(), [&](int i) { return right_.col(i).isZero(0); }), used.end());
    left_.resize(m, used.size());
    packed_.resize(m, used.size());
    for (std::size_t i = 0; i < used.size(); i++) {
      left_.col((Eigen::Index)i)   = right_.col(used[i]).head(m);
      packed_.col((Eigen::Index)i) = c.shapes.col(used[i]).head(m);
    }
    p.unsymmetric.setZero(m, m);
    AddProduct(left_, packed_, true, p.unsymmetric);
  }
  for (int b = 0; b < 2; b++) {
    if (!core.bends[b]) continue;
    const Eigen::MatrixXd &bend = b ? c.bend_rate : c.bend;
    AddProduct(bend, core.rigid_bend[b], true, p.rigid_modal);
    if (!p.unsymmetric.rows()) p.unsymmetric.setZero(m, m);
    p.unsymmetric.noalias() += c.shapes.topRows(m) * core.motion_bend[b] * bend.transpose();
  }
}

} // namespace hhtdae
