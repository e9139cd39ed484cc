/* What is wrong with a finite-element model, said in terms of its nodes. */
#include "diagnose.h"
#include "modes.h"
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <unordered_map>

namespace hhtdae
{

/* Entries of M that have to vanish or to be equal, relative to its largest */
constexpr double form_tolerance = 1e-8;
/* Couplings in K that count as none, relative to its largest entry: what is left of cancelling terms */
constexpr double no_coupling = 1e-15;

/* ---- lists of nodes ---- */

struct Ranked {
  double   value;
  PetscInt label;
};

static bool Before(const Ranked &a, const Ranked &b)
{
  return a.value > b.value || (a.value == b.value && a.label < b.label);
}

constexpr int most_named = 5;

/* The highest of all ranks, at most five */
static PetscErrorCode Highest(MPI_Comm comm, std::vector<Ranked> mine, std::vector<Ranked> *all)
{
  PetscMPIInt size;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  std::sort(mine.begin(), mine.end(), Before);
  mine.resize(most_named, {-1, -1});
  all->resize(size * most_named);
  PetscCallMPI(MPI_Allgather(mine.data(), most_named * sizeof(Ranked), MPI_BYTE, all->data(),
                             most_named * sizeof(Ranked), MPI_BYTE, comm));
  std::sort(all->begin(), all->end(), Before);
  all->resize(most_named);
  while (!all->empty() && all->back().value < 0) all->pop_back();
  PetscFunctionReturn(0);
}

static std::string List(const std::vector<Ranked> &nodes)
{
  std::string text;
  for (std::size_t i = 0; i < nodes.size(); i++) {
    if (i) text += i + 1 == nodes.size() ? " and " : ", ";
    text += std::to_string(nodes[i].label);
  }
  return text;
}

/* Own nodes that are bad: how many on all ranks and the first labels */
static PetscErrorCode NameNodes(const FeModel &model, const std::vector<PetscInt> &bad, PetscInt *count,
                                std::string *labels)
{
  std::vector<Ranked> mine, all;
  PetscInt            n = (PetscInt)bad.size();

  PetscFunctionBegin;
  PetscCallMPI(MPI_Allreduce(&n, count, 1, MPIU_INT, MPI_SUM, model.comm));
  for (PetscInt i : bad) mine.push_back({1, NodeLabel(model, i)});
  PetscCall(Highest(model.comm, mine, &all));
  *labels = List(all);
  if (*count > (PetscInt)all.size()) *labels += " ...";
  PetscFunctionReturn(0);
}

PetscErrorCode MostMoved(const FeModel &model, const Eigen::VectorXd &u, std::string *labels)
{
  std::vector<Ranked> mine, all;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < model.own; i++) mine.push_back({u.segment<3>(3 * i).norm(), NodeLabel(model, i)});
  PetscCall(Highest(model.comm, mine, &all));
  /* nodes at rest are not part of it */
  while (!all.empty() && all.back().value < 1e-3 * all.front().value) all.pop_back();
  *labels = List(all);
  PetscFunctionReturn(0);
}

PetscErrorCode MechanismError(const FeModel &model, const Eigen::VectorXd &u, const char where[])
{
  std::string labels;

  PetscFunctionBegin;
  PetscCall(MostMoved(model, u, &labels));
  SETERRQ(model.comm, PETSC_ERR_MAT_LU_ZRPVT,
          "The FE model has a mechanism: %s is singular beyond rigid-body motions. It moves without stiffness most at "
          "node(s) %s; look there for "
          "elements that hang on a node or an edge, or are missing",
          where, labels.c_str());
}

/* ---- sizes, symmetry, entries ---- */

static PetscErrorCode CheckLayout(const FeModel &model, Mat A, const char name[])
{
  PetscInt  begin, end, rows, cols;
  PetscBool aij;

  PetscFunctionBegin;
  PetscCheck(A, model.comm, PETSC_ERR_ARG_WRONGSTATE, "The FE model has no matrix %s: read a mesh or matrices first",
             name);
  PetscCall(PetscObjectTypeCompareAny((PetscObject)A, &aij, MATSEQAIJ, MATMPIAIJ, ""));
  PetscCheck(aij, model.comm, PETSC_ERR_ARG_WRONG, "The matrix %s of the FE model has to be AIJ (with both triangles)",
             name);
  PetscCall(MatGetSize(A, &rows, &cols));
  PetscCheck(rows == 3 * model.nodes && cols == rows, model.comm, PETSC_ERR_ARG_SIZ,
             "The matrix %s has %" PetscInt_FMT " rows and %" PetscInt_FMT " columns, but there are %" PetscInt_FMT
             " nodes of three unknowns",
             name, rows, cols, model.nodes);
  PetscCall(MatGetOwnershipRange(A, &begin, &end));
  int wrong = begin != 3 * model.first || end != 3 * (model.first + model.own) ||
              (PetscInt)model.coordinates.size() != 3 * model.own;
  for (double x : model.coordinates) wrong = wrong || !std::isfinite(x);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &wrong, 1, MPI_INT, MPI_MAX, model.comm));
  PetscCheck(!wrong, model.comm, PETSC_ERR_ARG_SIZ,
             "The rows of %s are not those of the ranks' own nodes, or there are not three finite coordinates for each "
             "own node",
             name);
  PetscFunctionReturn(0);
}

static double Pattern(PetscInt row, double k) { return std::sin(k * (double)row + 0.3 * k); }

/* y^T A x = x^T A y for two fixed vectors; Inf and NaN among the entries are found on the way */
static PetscErrorCode CheckSymmetric(const FeModel &model, Mat A, const char name[])
{
  MatrixXd  X(3 * model.own, 2), AX;
  double    s[3] = {0, 0, 0};
  PetscReal norm;

  PetscFunctionBegin;
  PetscCall(MatNorm(A, NORM_FROBENIUS, &norm)); /* of the others, NaN may go unseen */
  PetscCheck(std::isfinite(norm), model.comm, PETSC_ERR_FP,
             "The matrix %s of the FE model has entries that are not numbers", name);
  PetscCheck(norm > 0, model.comm, PETSC_ERR_ARG_WRONG, "The matrix %s of the FE model is zero", name);
  for (PetscInt i = 0; i < 3 * model.own; i++)
    X.row(i) << Pattern(3 * model.first + i, 1.1), Pattern(3 * model.first + i, 2.3);
  PetscCall(Multiply(A, X, &AX));
  if (X.rows()) {
    s[0] = X.col(0).dot(AX.col(1));
    s[1] = X.col(1).dot(AX.col(0));
    s[2] = X.squaredNorm();
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, s, 3, MPI_DOUBLE, MPI_SUM, model.comm));
  PetscCheck(std::abs(s[0] - s[1]) <= 1e-10 * norm * std::sqrt(s[2]), model.comm, PETSC_ERR_ARG_WRONG,
             "The matrix %s of the FE model is not symmetric; both triangles have to be given", name);
  PetscFunctionReturn(0);
}

/* Largest absolute entry of A, on all ranks */
static PetscErrorCode LargestEntry(MPI_Comm comm, Mat A, double *largest)
{
  PetscInt           begin, end, n;
  const PetscScalar *v;

  PetscFunctionBegin;
  *largest = 0;
  PetscCall(MatGetOwnershipRange(A, &begin, &end));
  for (PetscInt i = begin; i < end; i++) {
    PetscCall(MatGetRow(A, i, &n, nullptr, &v));
    for (PetscInt k = 0; k < n; k++) *largest = std::max(*largest, std::abs(v[k]));
    PetscCall(MatRestoreRow(A, i, &n, nullptr, &v));
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, largest, 1, MPI_DOUBLE, MPI_MAX, comm));
  PetscFunctionReturn(0);
}

/* The three rows of a node in M: m_ij by column node, and whether the blocks are m_ij times identity(3) */
static PetscErrorCode MassRow(Mat M, PetscInt node, double tiny, std::map<PetscInt, double> *mass, bool *right)
{
  std::map<PetscInt, Vector3> row;
  PetscInt                    n;
  const PetscInt             *cols;
  const PetscScalar          *v;

  PetscFunctionBegin;
  *right = true;
  for (int r = 0; r < 3; r++) {
    PetscCall(MatGetRow(M, 3 * node + r, &n, &cols, &v));
    for (PetscInt k = 0; k < n; k++) {
      if (cols[k] % 3 == r)
        row.emplace(cols[k] / 3, Vector3::Zero()).first->second[r] = v[k];
      else if (std::abs(v[k]) > tiny)
        *right = false;
    }
    PetscCall(MatRestoreRow(M, 3 * node + r, &n, &cols, &v));
  }
  mass->clear();
  for (const auto &m : row) {
    if (m.second.maxCoeff() - m.second.minCoeff() > tiny) *right = false;
    (*mass)[m.first] = m.second[0];
  }
  PetscFunctionReturn(0);
}

static PetscErrorCode CheckMass(const FeModel &model)
{
  std::vector<PetscInt>      wrong_form, not_positive;
  std::map<PetscInt, double> row;
  double                     largest;
  bool                       right;
  PetscInt                   count;
  std::string                labels;

  PetscFunctionBegin;
  PetscCall(LargestEntry(model.comm, model.M, &largest));
  for (PetscInt i = 0; i < model.own; i++) {
    PetscCall(MassRow(model.M, model.first + i, form_tolerance * largest, &row, &right));
    if (!right) wrong_form.push_back(i);
    const auto diagonal = row.find(model.first + i);
    if (diagonal == row.end() || !(diagonal->second > 0)) not_positive.push_back(i);
  }
  PetscCall(NameNodes(model, not_positive, &count, &labels));
  PetscCheck(
      !count, model.comm, PETSC_ERR_ARG_WRONG,
      "%" PetscInt_FMT
      " node(s) of the FE model have no mass or a negative one on the diagonal of M: %s; give all materials a density",
      count, labels.c_str());
  PetscCall(NameNodes(model, wrong_form, &count, &labels));
  PetscCheck(!count, model.comm, PETSC_ERR_ARG_WRONG,
             "M has to be m_ij times the 3 x 3 identity for all pairs of nodes, which translations of solid elements "
             "give. It is not at %" PetscInt_FMT
             " node(s): %s; are the unknowns in the order x, y, z of node after node, without rotations?",
             count, labels.c_str());
  PetscFunctionReturn(0);
}

static PetscErrorCode CheckStiffness(const FeModel &model)
{
  std::vector<PetscInt> loose, negative;
  double                largest;
  PetscInt              count, n;
  const PetscInt       *cols;
  const PetscScalar    *v;
  std::string           labels;

  PetscFunctionBegin;
  PetscCall(LargestEntry(model.comm, model.K, &largest));
  for (PetscInt i = 0; i < model.own; i++) {
    double most = 0, least = largest;
    for (int r = 0; r < 3; r++) {
      const PetscInt row      = 3 * (model.first + i) + r;
      double         diagonal = 0;
      PetscCall(MatGetRow(model.K, row, &n, &cols, &v));
      for (PetscInt k = 0; k < n; k++) {
        most = std::max(most, std::abs(v[k]));
        if (cols[k] == row) diagonal = v[k];
      }
      PetscCall(MatRestoreRow(model.K, row, &n, &cols, &v));
      least = std::min(least, diagonal);
    }
    if (most <= no_coupling * largest)
      loose.push_back(i);
    else if (least < 0)
      negative.push_back(i);
  }
  PetscCall(NameNodes(model, loose, &count, &labels));
  PetscCheck(!count, model.comm, PETSC_ERR_ARG_WRONG,
             "%" PetscInt_FMT " node(s) of the FE model have no stiffness: %s; no element holds them: remove them",
             count, labels.c_str());
  PetscCall(NameNodes(model, negative, &count, &labels));
  PetscCheck(!count, model.comm, PETSC_ERR_ARG_WRONG,
             "%" PetscInt_FMT
             " node(s) of the FE model have a negative stiffness on the diagonal of K: %s; are elements inside out?",
             count, labels.c_str());
  PetscFunctionReturn(0);
}

PetscErrorCode CheckMatrices(const FeModel &model)
{
  PetscFunctionBegin;
  PetscCheck(model.nodes > 0, model.comm, PETSC_ERR_ARG_WRONGSTATE,
             "The FE model has no nodes: read a mesh or matrices first");
  PetscCall(CheckLayout(model, model.K, "K"));
  PetscCall(CheckLayout(model, model.M, "M"));
  PetscCall(CheckSymmetric(model, model.K, "K"));
  PetscCall(CheckSymmetric(model, model.M, "M"));
  PetscCall(CheckMass(model));
  PetscCall(CheckStiffness(model));
  PetscFunctionReturn(0);
}

/* ---- connected parts ---- */

/* Union-find among own nodes and the nodes of other ranks that own ones couple with */
class Parts
{
public:
  std::vector<PetscInt> ghosts; /* global numbers */

  explicit Parts(const FeModel &model) : model_(model), parent_(model.own)
  {
    std::iota(parent_.begin(), parent_.end(), 0);
  }

  PetscInt root(PetscInt i)
  {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(PetscInt i, PetscInt j)
  {
    i = root(i);
    j = root(j);
    if (i != j) parent_[std::max(i, j)] = std::min(i, j);
  }
  PetscInt place(PetscInt global)
  {
    if (global >= model_.first && global < model_.first + model_.own) return global - model_.first;
    const auto found = number_.emplace(global, (PetscInt)parent_.size());
    if (found.second) {
      ghosts.push_back(global);
      parent_.push_back(found.first->second);
    }
    return found.first->second;
  }
  PetscInt size() const { return (PetscInt)parent_.size(); }

private:
  const FeModel                         &model_;
  std::vector<PetscInt>                  parent_;
  std::unordered_map<PetscInt, PetscInt> number_;
};

static PetscErrorCode JoinNeighbours(const FeModel &model, const std::vector<Tied> &tied, Parts *parts)
{
  double             largest;
  PetscInt           n;
  const PetscInt    *cols;
  const PetscScalar *v;

  PetscFunctionBegin;
  PetscCall(LargestEntry(model.comm, model.K, &largest));
  for (PetscInt row = 0; row < 3 * model.own; row++) {
    PetscCall(MatGetRow(model.K, 3 * model.first + row, &n, &cols, &v));
    for (PetscInt k = 0; k < n; k++)
      if (std::abs(v[k]) > no_coupling * largest) parts->join(row / 3, parts->place(cols[k] / 3));
    PetscCall(MatRestoreRow(model.K, 3 * model.first + row, &n, &cols, &v));
  }
  for (const Tied &t : tied)
    if (t.tie == Tie::Rigid)
      for (PetscInt i : t.node) parts->join(t.node[0], i);
  PetscFunctionReturn(0);
}

/* The least number of a node in each one's part, by exchange until nothing changes */
static PetscErrorCode SpreadLeast(const FeModel &model, const std::vector<Tied> &tied, Parts *parts,
                                  std::vector<double> *least)
{
  Vec                 x, local;
  PetscScalar        *v;
  std::vector<double> link(tied.size());
  int                 changed = 1;

  PetscFunctionBegin;
  PetscCall(
      VecCreateGhost(model.comm, model.own, PETSC_DETERMINE, (PetscInt)parts->ghosts.size(), parts->ghosts.data(), &x));
  least->resize(parts->size());
  for (PetscInt i = 0; i < parts->size(); i++)
    (*least)[i] = (double)(i < model.own ? model.first + i : parts->ghosts[i - model.own]);
  while (changed) {
    changed   = 0;
    auto take = [&](PetscInt i, double value) {
      double &mine = (*least)[parts->root(i)];
      if (value < mine) {
        mine    = value;
        changed = 1;
      }
    };
    for (PetscInt i = 0; i < parts->size(); i++) take(i, (*least)[i]);
    for (std::size_t a = 0; a < tied.size(); a++)
      link[a] = tied[a].tie == Tie::Rigid && !tied[a].node.empty() ? (*least)[parts->root(tied[a].node[0])]
                                                                   : (double)model.nodes;
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, link.data(), (PetscMPIInt)link.size(), MPI_DOUBLE, MPI_MIN, model.comm));
    for (std::size_t a = 0; a < tied.size(); a++)
      if (tied[a].tie == Tie::Rigid && !tied[a].node.empty()) take(tied[a].node[0], link[a]);
    PetscCall(VecGhostGetLocalForm(x, &local));
    PetscCall(VecGetArray(local, &v));
    for (PetscInt i = 0; i < parts->size(); i++) v[i] = (*least)[parts->root(i)];
    PetscCall(VecRestoreArray(local, &v));
    /* what a rank knows of a node of another one, then what that one knows */
    PetscCall(VecGhostUpdateBegin(x, MIN_VALUES, SCATTER_REVERSE));
    PetscCall(VecGhostUpdateEnd(x, MIN_VALUES, SCATTER_REVERSE));
    PetscCall(VecGhostUpdateBegin(x, INSERT_VALUES, SCATTER_FORWARD));
    PetscCall(VecGhostUpdateEnd(x, INSERT_VALUES, SCATTER_FORWARD));
    PetscCall(VecGetArray(local, &v));
    for (PetscInt i = 0; i < parts->size(); i++) take(i, v[i]);
    PetscCall(VecRestoreArray(local, &v));
    PetscCall(VecGhostRestoreLocalForm(x, &local));
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &changed, 1, MPI_INT, MPI_MAX, model.comm));
  }
  PetscCall(VecDestroy(&x));
  PetscFunctionReturn(0);
}

/* Sizes of the parts that begin with the nodes `start` */
static PetscErrorCode PartSizes(const FeModel &model, Parts *parts, const std::vector<double> &least,
                                const std::vector<Ranked> &start, std::vector<PetscInt> *size)
{
  PetscFunctionBegin;
  size->assign(start.size(), 0);
  for (PetscInt i = 0; i < model.own; i++)
    for (std::size_t k = 0; k < start.size(); k++)
      if (least[parts->root(i)] == (double)model.nodes - start[k].value) (*size)[k]++;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, size->data(), (PetscMPIInt)size->size(), MPIU_INT, MPI_SUM, model.comm));
  PetscFunctionReturn(0);
}

PetscErrorCode CheckConnected(const FeModel &model, const std::vector<Tied> &tied)
{
  Parts                 parts(model);
  std::vector<double>   least;
  std::vector<Ranked>   mine, first;
  std::vector<PetscInt> size;
  PetscInt              count;

  PetscFunctionBegin;
  PetscCall(JoinNeighbours(model, tied, &parts));
  PetscCall(SpreadLeast(model, tied, &parts, &least));
  for (PetscInt i = 0; i < model.own; i++)
    if (least[parts.root(i)] == (double)(model.first + i))
      mine.push_back({(double)(model.nodes - model.first - i), NodeLabel(model, i)});
  count = (PetscInt)mine.size();
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &count, 1, MPIU_INT, MPI_SUM, model.comm));
  if (count == 1) PetscFunctionReturn(0);
  PetscCall(Highest(model.comm, mine, &first));
  PetscCall(PartSizes(model, &parts, least, first, &size));
  std::string text;
  for (std::size_t k = 0; k < first.size(); k++)
    text += (k ? "; " : "") + std::to_string(size[k]) + " nodes with node " + std::to_string(first[k].label);
  SETERRQ(
      model.comm, PETSC_ERR_ARG_WRONG,
      "The FE model falls into %" PetscInt_FMT
      " parts that nothing holds together: %s%s; join them (coincident nodes that were not merged?), or reduce them as "
      "separate bodies",
      count, text.c_str(), count > (PetscInt)first.size() ? "; ..." : "");
}

/* ---- sizes ---- */

/* X_c dm as a block: M times 1, and M times X, three components each */
static PetscErrorCode MassMoments(const FeModel &model, BodyScales *s)
{
  MatrixXd X(3 * model.own, 2), MX;
  double   sums[4] = {0, 0, 0, 0};

  PetscFunctionBegin;
  for (PetscInt i = 0; i < 3 * model.own; i++) X.row(i) << 1., model.coordinates[i];
  PetscCall(Multiply(model.M, X, &MX));
  for (PetscInt i = 0; i < 3 * model.own; i++) {
    sums[i % 3] += MX(i, 1);
    sums[3] += MX(i, 0) / 3;
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sums, 4, MPI_DOUBLE, MPI_SUM, model.comm));
  s->mass = sums[3];
  PetscCheck(s->mass > 0, model.comm, PETSC_ERR_ARG_WRONG, "The FE model has the mass %g: M is not positive", s->mass);
  s->center = Vector3(sums[0], sums[1], sums[2]) / s->mass;
  for (PetscInt i = 0; i < 3 * model.own; i++) X(i, 1) -= s->center[i % 3];
  PetscCall(Multiply(model.M, X, &MX));
  s->moments.setZero();
  for (PetscInt i = 0; i < model.own; i++) s->moments += X.block<3, 1>(3 * i, 1) * MX.block<3, 1>(3 * i, 1).transpose();
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, s->moments.data(), 9, MPI_DOUBLE, MPI_SUM, model.comm));
  s->moments = 0.5 * (s->moments + s->moments.transpose()).eval();
  PetscFunctionReturn(0);
}

static PetscErrorCode Extents(const FeModel &model, BodyScales *s)
{
  double       ends[7];
  Vec          k, m;
  PetscScalar *kk, *mm;

  PetscFunctionBegin;
  std::fill(ends, ends + 7, -PETSC_MAX_REAL);
  for (PetscInt i = 0; i < 3 * model.own; i++) {
    ends[i % 3]     = std::max(ends[i % 3], model.coordinates[i]);
    ends[3 + i % 3] = std::max(ends[3 + i % 3], -model.coordinates[i]);
  }
  PetscCall(MatCreateVecs(model.K, &k, &m));
  PetscCall(MatGetDiagonal(model.K, k));
  PetscCall(MatGetDiagonal(model.M, m));
  PetscCall(VecGetArray(k, &kk));
  PetscCall(VecGetArray(m, &mm));
  for (PetscInt i = 0; i < 3 * model.own; i++) ends[6] = std::max(ends[6], kk[i] / mm[i]);
  PetscCall(VecRestoreArray(k, &kk));
  PetscCall(VecRestoreArray(m, &mm));
  PetscCall(VecDestroy(&k));
  PetscCall(VecDestroy(&m));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, ends, 7, MPI_DOUBLE, MPI_MAX, model.comm));
  s->volume = 1;
  s->length = 0;
  for (int c = 0; c < 3; c++) {
    s->volume *= ends[c] + ends[3 + c];
    s->length = std::max(s->length, std::max(ends[c] - s->center[c], ends[3 + c] + s->center[c]));
  }
  s->stiff = ends[6];
  PetscFunctionReturn(0);
}

static PetscErrorCode RigidBasis(const FeModel &model, BodyScales *s)
{
  const Matrix3                                inertia = s->moments.trace() * Matrix3::Identity() - s->moments;
  const Eigen::SelfAdjointEigenSolver<Matrix3> principal(inertia);

  PetscFunctionBegin;
  PetscCheck(principal.eigenvalues()[0] > 1e-10 * principal.eigenvalues()[2], model.comm, PETSC_ERR_ARG_WRONG,
             "All mass of the FE model is on one line, its least moment of inertia is %g; it needs an extent across",
             principal.eigenvalues()[0]);
  s->frame.setZero();
  s->frame.topLeftCorner<3, 3>() = Matrix3::Identity() / std::sqrt(s->mass);
  for (int k = 0; k < 3; k++)
    s->frame.block<3, 1>(3, 3 + k) = principal.eigenvectors().col(k) / std::sqrt(principal.eigenvalues()[k]);
  s->rigid.resize(3 * model.own, 6);
  for (PetscInt i = 0; i < model.own; i++)
    s->rigid.middleRows(3 * i, 3) = RigidMotion(NodePosition(model, i), s->center) * s->frame;
  PetscFunctionReturn(0);
}

/* Ritz values for displacements which are quadratic in the coordinates */
static PetscErrorCode QuadraticRitz(const FeModel &model, BodyScales *s)
{
  MatrixXd X = MatrixXd::Zero(3 * model.own, 24), Y, K, M;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < model.own; i++) {
    const Vector3 x        = (NodePosition(model, i) - s->center) / s->length;
    const double  field[9] = {x[0],        x[1],        x[2],        x[0] * x[0], x[1] * x[1],
                              x[2] * x[2], x[0] * x[1], x[1] * x[2], x[2] * x[0]};
    int           col      = 0;
    for (int c = 0; c < 3; c++)
      for (int k = 0; k < 9; k++)
        if (k > 2 || k <= c) X(3 * i + c, col++) = field[k]; /* of the linear ones, rotations apart */
  }
  /* rigid motions are taken out in M */
  MatrixXd part;
  PetscCall(Multiply(model.M, s->rigid, &Y));
  PetscCall(LocalProduct(Y, X, &part));
  PetscCall(SumOverRanks(model.comm, &part));
  X -= s->rigid * part;
  PetscCall(Multiply(model.K, X, &Y));
  PetscCall(LocalProduct(X, Y, &K));
  PetscCall(Multiply(model.M, X, &Y));
  PetscCall(LocalProduct(X, Y, &M));
  PetscCall(SumOverRanks(model.comm, &K));
  PetscCall(SumOverRanks(model.comm, &M));
  const VectorXd                                scale = M.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const MatrixXd                                Ms    = scale.asDiagonal() * M * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> mass(0.5 * (Ms + Ms.transpose()));
  PetscInt                                      from = 0; /* fields that few or flat nodes do not tell apart */
  while (from < 23 && mass.eigenvalues()[from] < 1e-8) from++;
  const PetscInt n = 24 - from;
  const MatrixXd W = scale.asDiagonal() * mass.eigenvectors().rightCols(n) *
                     mass.eigenvalues().tail(n).cwiseSqrt().cwiseInverse().asDiagonal();
  const MatrixXd                                Kw = W.transpose() * K * W;
  const Eigen::SelfAdjointEigenSolver<MatrixXd> ritz(0.5 * (Kw + Kw.transpose()), Eigen::EigenvaluesOnly);
  s->soft = ritz.eigenvalues()[n - 1];
  for (PetscInt k = n; k-- > 0;) /* a mechanism among them is not the scale */
    if (ritz.eigenvalues()[k] > 1e-9 * ritz.eigenvalues()[n - 1]) s->soft = ritz.eigenvalues()[k];
  PetscFunctionReturn(0);
}

PetscErrorCode ComputeScales(const FeModel &model, BodyScales *scales)
{
  PetscFunctionBegin;
  PetscCall(MassMoments(model, scales));
  PetscCall(Extents(model, scales));
  PetscCall(RigidBasis(model, scales));
  PetscCall(QuadraticRitz(model, scales));
  PetscCheck(scales->soft > 0, model.comm, PETSC_ERR_ARG_WRONG,
             "The FE model has no elastic stiffness: K vanishes for quadratic displacements");
  PetscFunctionReturn(0);
}

/* ---- supports ---- */

PetscErrorCode CheckUnsupported(const FeModel &model, const BodyScales &s)
{
  static const char *const motion[6] = {"translation along x",
                                        "translation along y",
                                        "translation along z",
                                        "rotation about its axis of least inertia",
                                        "rotation about its axis of middle inertia",
                                        "rotation about its axis of greatest inertia"};
  MatrixXd                 Kr;
  VectorXd                 energy(6);

  PetscFunctionBegin;
  PetscCall(Multiply(model.K, s.rigid, &Kr));
  for (int k = 0; k < 6; k++) energy[k] = model.own ? s.rigid.col(k).dot(Kr.col(k)) : 0.;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, energy.data(), 6, MPI_DOUBLE, MPI_SUM, model.comm));
  for (int k = 0; k < 6; k++) {
    /* coordinates have fewer digits than K: a rotation then strains elements a little */
    const double allowed = k < 3 ? 1e-6 * s.soft + 1e-14 * s.stiff : 1e-4 * s.soft + 1e-13 * s.stiff;
    if (std::abs(energy[k]) <= allowed) continue;
    std::string labels;
    PetscCall(MostMoved(model, Kr.col(k), &labels));
    SETERRQ(model.comm, PETSC_ERR_ARG_WRONG,
            "K is not free of supports: a rigid %s (of modal mass 1) meets the stiffness %g, elastic modes begin at %g "
            "or lower. The forces act most at node(s) %s: "
            "take supports and springs to ground out of the FE model, or correct the coordinates, their units or the "
            "order of unknowns",
            motion[k], energy[k], s.soft, labels.c_str());
  }
  PetscFunctionReturn(0);
}

/* ---- units ---- */

std::string SuspectUnits(const FeModel &model, const BodyScales &s)
{
  char text[512];
  /* waves run at some 1000 m/s in solids: sqrt(K_ii / M_ii) times the distance of nodes is of that size, in m/s or mm/s
   * or in/s */
  const double distance  = std::cbrt(std::max(s.volume, 1e-9 * s.length * s.length * s.length) / (double)model.nodes);
  const double speed     = distance * std::sqrt(s.stiff) / 6; /* for bricks, and nearly for tetrahedra */
  const double frequency = std::sqrt(s.soft) / (2 * PETSC_PI);
  if (speed > 10 && speed < 5e7) return "";
  snprintf(text, sizeof text,
           "units suspect: waves would run through the body at about %.1e units of length per unit of time (some 1e3 "
           "m/s are usual), the first "
           "elastic frequency is below %.1e; mass %.4g, extent %.3g. Young's modulus in N/m^2 goes with m, kg, s; in "
           "N/mm^2 with mm, tonne, s",
           speed, frequency, s.mass, s.length);
  return text;
}

} // namespace hhtdae
