/* A finite-element body with small displacements: M (x'' - g) + (a M + b K) x' + K (x - X), rows of own nodes. */
#include "flexible/full_nodes.h"
#include "scene/symmetric.h"
#include <algorithm>

namespace hhtdae
{

namespace
{

constexpr double max_rotation = 0.1; /* rad; the user is warned beyond it: strains are then wrong by half of its square */

/* The mean rotation w of a body for displacements d, J w = sum r x d, valid for small rotations */
class MeanRotation
{
public:
  void setUp(const double *X, std::size_t nodes)
  {
    Matrix3 J = Matrix3::Zero();
    for (std::size_t i = 0; i < nodes; i++) center_ += place(X, i) / (double)nodes;
    for (std::size_t i = 0; i < nodes; i++) {
      const Vector3 r = place(X, i) - center_;
      J += r.squaredNorm() * Matrix3::Identity() - r * r.transpose();
    }
    const SymmetricEigen principal(J);
    for (int k = 0; nodes && k < 3; k++)
      if (principal.values[k] > 1e-10 * principal.values[2]) inverse_ += Matrix3(principal.vectors.col(k) * principal.vectors.col(k).transpose()) / principal.values[k];
  }
  Vector3 moment(const double *X, std::size_t i, const Vector3 &d) const { return (place(X, i) - center_).cross(d); }
  double  angle(const Vector3 &moment) const { return (inverse_ * moment).norm(); }

private:
  Vector3 center_  = Vector3::Zero();
  Matrix3 inverse_ = Matrix3::Zero();

  static Vector3 place(const double *X, std::size_t i) { return Eigen::Map<const Vector3>(X + 3 * i); }
};

class MatrixBatch : public Batch
{
public:
  const FullExtension   &x;
  std::vector<NodePlace> near;
  PetscInt               own; /* index of the first own node in near */

  MatrixBatch(const FullExtension &e, Localizer &l) : x(e)
  {
    for (PetscInt n : x.near) near.push_back(PlaceNode(x, l, n));
    own = (PetscInt)(std::lower_bound(x.near.begin(), x.near.end(), x.model->first) - x.near.begin());
    if (monitorsRotation()) mean_rotation_.setUp(&x.near_x[3 * own], (std::size_t)x.model->own);
  }

  void pattern(Pattern &p) override
  {
    for (PetscInt n = 0; n < x.model->own; n++)
      for (PetscInt k = x.block_first[n]; k < x.block_first[n + 1]; k++) request_.push_back(p.need(near[own + n].group, near[x.block_near[k]].group));
  }

  void residual(Evaluation &ev) override
  {
    const double a = x.spec.mass_damping, b = x.spec.stiffness_damping;
    for (PetscInt n = 0; n < x.model->own; n++) {
      Vector3 f = Vector3::Zero();
      for (PetscInt k = x.block_first[n]; k < x.block_first[n + 1]; k++) {
        const NodePlace &j = near[x.block_near[k]];
        const Vector3    v = At(ev.v, j);
        f += x.block_M[k] * (At(ev.a, j) - ev.bodies.gravity + a * v) + x.block_K[k] * (displacement(ev, x.block_near[k]) + b * v);
      }
      AddRows(ev, near[own + n], f);
    }
  }

  void jacobian(Evaluation &ev) override
  {
    const double m = ev.sa + ev.sv * x.spec.mass_damping, s = 1 + ev.sv * x.spec.stiffness_damping;
    for (std::size_t k = 0; k < slot_.size(); k++) ev.sink.add(slot_[k], Matrix3(m * x.block_M[k] + s * x.block_K[k]), 3, 3);
  }

  /* Does not limit the step, but warns once if the body has rotated too far for small displacements (FullBody.TurnsTooFarForSmallDisplacements) */
  bool   limitsSteps() const override { return monitorsRotation(); }
  double longestStep(const Evaluation &ev, const Horizon &) const override
  {
    Vector3 moment = Vector3::Zero();
    if (warned_) return std::numeric_limits<double>::infinity();
    for (PetscInt n = 0; n < x.model->own; n++) moment += mean_rotation_.moment(&x.near_x[3 * own], (std::size_t)n, displacement(ev, own + n));
    warned_ = mean_rotation_.angle(moment) > max_rotation;
    if (warned_)
      PetscCallAbort(PETSC_COMM_SELF, PetscPrintf(PETSC_COMM_SELF,
                                                  "scene: at t = %g full body %s has turned by more than %g rad since the start: with law small its strains are those of a body that does not turn, and wrong by %g; "
                                                  "use law large\n",
                                                  ev.t, x.name.c_str(), max_rotation, 0.5 * max_rotation * max_rotation));
    return std::numeric_limits<double>::infinity();
  }

  void addTo(Balance &B, const Evaluation &ev) const override
  {
    for (PetscInt n = 0; n < x.model->own; n++) {
      const NodePlace &i = near[own + n];
      Vector3          p = Vector3::Zero(), weight = p, f = p;
      for (PetscInt k = x.block_first[n]; k < x.block_first[n + 1]; k++) {
        p += x.block_M[k] * At(ev.v, near[x.block_near[k]]);
        weight += x.block_M[k] * ev.bodies.gravity;
        f += x.block_K[k] * displacement(ev, x.block_near[k]);
      }
      B.kinetic += 0.5 * p.dot(At(ev.v, i));
      B.gravity -= weight.dot(At(ev.u, i));
      B.elastic += 0.5 * f.dot(displacement(ev, own + n));
      B.linear += p;
      B.angular += At(ev.u, i).cross(p);
    }
  }

private:
  MeanRotation mean_rotation_; /* of the first rank's nodes, as an estimate for the body */
  mutable bool warned_ = false;

  bool    monitorsRotation() const { return x.model->first == 0 && x.model->own > 2; }
  Vector3 displacement(const Evaluation &ev, PetscInt k) const { return At(ev.u, near[k]) - Eigen::Map<const Vector3>(&x.near_x[3 * k]); }
};

/* Blocks of K and M in one node's rows, by the global number of the column's node */
using Row = std::map<PetscInt, std::pair<Matrix3, Matrix3>>;

PetscErrorCode AddRow(Mat A, PetscInt row, bool mass, Row *blocks)
{
  PetscInt           n;
  const PetscInt    *columns;
  const PetscScalar *values;
  PetscFunctionBegin;
  PetscCall(MatGetRow(A, row, &n, &columns, &values));
  for (PetscInt k = 0; k < n; k++) {
    auto found = blocks->find(columns[k] / 3);
    if (found == blocks->end()) found = blocks->emplace(columns[k] / 3, std::make_pair(Matrix3(Matrix3::Zero()), Matrix3(Matrix3::Zero()))).first;
    (mass ? found->second.second : found->second.first)(row % 3, columns[k] % 3) = values[k];
  }
  PetscCall(MatRestoreRow(A, row, &n, &columns, &values));
  PetscFunctionReturn(0);
}

/* Fetches the initial positions of the nodes in x.near from their owners */
PetscErrorCode FetchPositions(FullExtension &x)
{
  const FeModel        &m = *x.model;
  std::vector<PetscInt> index;
  Vec                   all, here;
  IS                    from;
  VecScatter            scatter;
  double               *a;
  PetscFunctionBegin;
  PetscCall(VecCreateMPIWithArray(m.comm, 3, 3 * m.own, PETSC_DETERMINE, x.u.data(), &all));
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, 3 * (PetscInt)x.near.size(), &here));
  PetscCall(ISCreateBlock(m.comm, 3, (PetscInt)x.near.size(), x.near.data(), PETSC_COPY_VALUES, &from));
  PetscCall(VecScatterCreate(all, from, here, nullptr, &scatter));
  PetscCall(VecScatterBegin(scatter, all, here, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(scatter, all, here, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecGetArray(here, &a));
  x.near_x.assign(a, a + 3 * x.near.size());
  PetscCall(VecRestoreArray(here, &a));
  PetscCall(VecScatterDestroy(&scatter));
  PetscCall(ISDestroy(&from));
  PetscCall(VecDestroy(&here));
  PetscCall(VecDestroy(&all));
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode ExtractBlocks(FullExtension &x)
{
  const FeModel   &m = *x.model;
  const Matrix3    R = x.spec.rotation;
  PetscFunctionBegin;
  x.block_first.assign(1, 0);
  for (PetscInt n = 0; n < m.own; n++) {
    Row row;
    for (int c = 0; c < 3; c++) {
      PetscCall(AddRow(m.K, 3 * (m.first + n) + c, false, &row));
      PetscCall(AddRow(m.M, 3 * (m.first + n) + c, true, &row));
    }
    for (const auto &b : row) {
      x.block_near.push_back(b.first);
      x.block_K.push_back(R * b.second.first * R.transpose());
      x.block_M.push_back(R * b.second.second * R.transpose());
    }
    x.block_first.push_back((PetscInt)x.block_near.size());
  }
  x.near = x.block_near;
  for (PetscInt n = 0; n < m.own; n++) x.near.push_back(m.first + n);
  std::sort(x.near.begin(), x.near.end());
  x.near.erase(std::unique(x.near.begin(), x.near.end()), x.near.end());
  for (PetscInt &n : x.block_near) n = (PetscInt)(std::lower_bound(x.near.begin(), x.near.end(), n) - x.near.begin());
  PetscCall(FetchPositions(x));
  PetscFunctionReturn(0);
}

void LocalizeMatrices(const FullExtension &x, Localizer &l, std::vector<std::unique_ptr<Batch>> &batches)
{
  batches.push_back(std::make_unique<MatrixBatch>(x, l));
}

} // namespace hhtdae
