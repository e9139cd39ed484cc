/*
  Finds redundant constraints: rows of Phi_q that depend linearly on others.

  If the rows of a body are independent in the columns of this body, none of them can be part of a linear dependence: the body
  and its rows are removed, and its neighbours are examined again. This removes all tree structures. The rows of the remaining
  loops are reduced by sparse Gaussian elimination, row by row in a fill-reducing order of the elements; rows that become zero
  are redundant. (Sparse QR is some hundred times slower on nets of loops.) Every rank has the description and makes the same
  computation.

  Rows are scaled: translations are in units of LengthOfBodies(), modal coordinates in units that move the body's mass by this
  length (SmallBodies.Attachments), and each row has norm one.

  At a singular position rows may be dependent that are independent elsewhere. So redundant rows are determined again at a neighbouring position that
  satisfies the constraints, and only rows that are redundant at both positions are dropped.
*/
#include "extension.h"
#include "start.h"
#include <Eigen/Dense>
#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <deque>
#include <queue>
#include <random>

namespace hhtdae
{

namespace
{

constexpr double clearly_independent = 1e-3; /* a body is removed if all pivots of its rows, which have norm one, are at least this large */
constexpr double neighbour_distance  = 0.02; /* displacement to the neighbouring position: radians, parts of the scene's size */

/* Pivots below this, of rows of norm one, count as zero, since dimensions and directions are described to about seven
   digits. With 1e-9 a hinge 1e-8 rad out of line locked a linkage without a message and caused arbitrarily large moments
   (SceneRedundant.AHingeSlightlyOutOfLine). */
constexpr double rounding_of_descriptions = 1e-6;

using Sparse = Eigen::SparseMatrix<double, Eigen::ColMajor, int>;

struct RowRef {
  std::size_t block;
  int         row;
};

/* Scales the rows: translations in units of `size`, modal coordinates by size * sqrt(mass), rows to norm one */
void Scale(const SceneData &s, std::vector<RowBlock> &blocks, double size)
{
  for (RowBlock &b : blocks) {
    for (std::size_t k = 0; k < b.body.size(); k++) {
      const BodyData         &body = s.bodies[b.body[k]];
      const std::vector<int> &d    = Directions(KindOf(s, body));
      for (int c = b.column[k]; c < b.column[k + 1]; c++) {
        if (c - b.column[k] >= (int)d.size()) b.J.col(c) *= size * std::sqrt(body.mass);
        else if (d[c - b.column[k]] < 3) b.J.col(c) *= size;
      }
    }
    for (int r = 0; r < b.rows; r++) {
      const double norm = b.J.row(r).norm();
      if (norm > 0) b.J.row(r) /= norm;
    }
  }
}

/* Unit of translations when they are compared with rotations: the scene's size, but at most ten times the largest
   distance of a marker from its body's centre of mass, so that a small mechanism far from the origin or from other
   mechanisms is scaled properly */
double LengthOfBodies(const SceneData &s)
{
  double arm = 0, size = SceneSize(s);
  for (std::size_t m = 0; m < s.ownMarkers(); m++)
    if (s.markers[m].body >= 0) arm = std::max(arm, s.markers[m].s.norm());
  return arm > 0 ? std::min(size, 10 * arm) : size;
}

/* Removes tree structures; core() returns the remaining rows in the order of the blocks */
class Pruning
{
public:
  Pruning(const SceneData &s, const std::vector<RowBlock> &blocks)
      : s_(s), blocks_(blocks), blocks_at_(s.bodies.size()), open_(blocks.size())
  {
    for (std::size_t k = 0; k < blocks.size(); k++) {
      open_[k] = blocks[k].active & ((1u << blocks[k].rows) - 1);
      for (PetscInt b : blocks[k].body) blocks_at_[b].push_back(k);
    }
    std::vector<char>    queued(s.bodies.size(), 1);
    std::deque<PetscInt> queue;
    for (std::size_t b = 0; b < s.bodies.size(); b++) queue.push_back((PetscInt)b);
    while (!queue.empty()) {
      const PetscInt b = queue.front();
      queue.pop_front();
      queued[b] = 0;
      for (std::size_t k : cutOff(b))
        for (PetscInt c : blocks_[k].body)
          if (c != b && !queued[c]) {
            queued[c] = 1;
            queue.push_back(c);
          }
    }
  }
  std::vector<RowRef> core() const
  {
    std::vector<RowRef> rows;
    for (std::size_t k = 0; k < blocks_.size(); k++)
      for (int r = 0; r < blocks_[k].rows; r++)
        if (open_[k] >> r & 1) rows.push_back({k, r});
    return rows;
  }

private:
  const SceneData                      &s_;
  const std::vector<RowBlock>          &blocks_;
  std::vector<std::vector<std::size_t>> blocks_at_; /* blocks of rows that contain each body */
  std::vector<unsigned>                 open_;      /* bits of the remaining rows of each block */

  /* Removes the rows at body b if they are independent in its columns; returns the blocks that have lost rows */
  std::vector<std::size_t> cutOff(PetscInt b)
  {
    const int           width = Width(s_, b);
    std::vector<RowRef> rows;
    for (std::size_t k : blocks_at_[b]) {
      const RowBlock &e    = blocks_[k];
      const auto      body = std::find(e.body.begin(), e.body.end(), b) - e.body.begin();
      for (int r = 0; r < e.rows; r++) {
        if (!(open_[k] >> r & 1) || e.J.row(r).segment(e.column[body], width).isZero(0)) continue;
        if ((int)rows.size() == width) return {};
        rows.push_back({k, r});
      }
    }
    if (rows.empty()) return {};
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic> A(width, rows.size());
    for (std::size_t i = 0; i < rows.size(); i++) {
      const RowBlock &e = blocks_[rows[i].block];
      A.col(i)          = e.J.row(rows[i].row)
                     .segment(e.column[std::find(e.body.begin(), e.body.end(), b) - e.body.begin()], width)
                     .transpose();
    }
    if (std::abs(Eigen::ColPivHouseholderQR<Eigen::MatrixXd>(A).matrixR()(rows.size() - 1, rows.size() - 1)) <
        clearly_independent)
      return {};
    std::vector<std::size_t> changed;
    for (const RowRef &r : rows) {
      open_[r.block] &= ~(1u << r.row);
      if (changed.empty() || changed.back() != r.block) changed.push_back(r.block);
    }
    return changed;
  }
};

/* Order of elimination. The last of several dependent rows is dropped. So elements that are never redundant come first,
   the others in the order of COLAMD for the matrix of elements and bodies, which reduces fill; within an element rows for
   positions come before rows for directions. */
std::vector<std::size_t> EliminationOrder(const std::vector<RowBlock> &blocks, const std::vector<RowRef> &core,
                                          std::size_t bodies)
{
  std::vector<std::size_t>            first; /* first row of each element */
  std::vector<Eigen::Triplet<double>> entry;
  for (std::size_t k = 0; k < core.size(); k++) {
    if (!k || blocks[core[k].block].element != blocks[core[k - 1].block].element) first.push_back(k);
    for (PetscInt b : blocks[core[k].block].body) entry.emplace_back((int)b, (int)first.size() - 1, 1.0);
  }
  Sparse A((int)bodies, (int)first.size());
  A.setFromTriplets(entry.begin(), entry.end());
  A.makeCompressed();
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> p;
  Eigen::COLAMDOrdering<int>()(A, p);
  std::vector<std::size_t> place(first.size()), order;
  for (std::size_t e = 0; e < first.size(); e++) place[p.indices()(e)] = e;
  std::stable_partition(place.begin(), place.end(),
                        [&](std::size_t e) { return blocks[core[first[e]].block].store->neverRedundant(); });
  for (std::size_t e : place)
    for (bool length : {true, false})
      for (std::size_t k = first[e]; k < (e + 1 < first.size() ? first[e + 1] : core.size()); k++)
        if (blocks[core[k].block].length == length) order.push_back(k);
  return order;
}

/*
  Gaussian elimination of one sparse row after the other. The pivot of a row is its largest entry after elimination; a row whose entries
  are then all zero is a linear combination of the rows before it.
*/
class Elimination
{
public:
  explicit Elimination(int columns) : pivot_(columns, -1), work_(columns, 0.0), seen_(columns, 0) {}

  /* Adds a row; returns false if it depends on the rows that were added before */
  bool add(const std::vector<std::pair<int, double>> &row, double threshold)
  {
    std::vector<int> touched;
    const auto       touch = [&](int c) {
      if (seen_[c]) return;
      seen_[c] = 1;
      touched.push_back(c);
      if (pivot_[c] >= 0) next_.push(pivot_[c]);
    };
    for (const auto &e : row) {
      touch(e.first);
      work_[e.first] += e.second;
    }
    while (!next_.empty()) {
      const Row &p = rows_[next_.top()];
      next_.pop();
      const double factor = work_[p.column];
      work_[p.column]     = 0;
      if (factor == 0) continue;
      for (const auto &e : p.rest) {
        touch(e.first);
        work_[e.first] -= factor * e.second;
      }
    }
    return keep(touched, threshold);
  }

private:
  struct Row {
    int                                 column;
    std::vector<std::pair<int, double>> rest; /* divided by the pivot */
  };
  std::vector<int>                                              pivot_; /* for each column: the row whose pivot it is, or -1 */
  std::vector<double>                                           work_;
  std::vector<char>                                             seen_;
  std::vector<Row>                                              rows_;
  std::priority_queue<int, std::vector<int>, std::greater<int>> next_;

  bool keep(std::vector<int> &touched, double threshold)
  {
    int best = -1;
    std::sort(touched.begin(), touched.end());
    for (int c : touched)
      if (pivot_[c] < 0 && (best < 0 || std::abs(work_[c]) > std::abs(work_[best]))) best = c;
    const bool good = best >= 0 && std::abs(work_[best]) > threshold;
    if (good) {
      Row r{best, {}};
      for (int c : touched)
        if (c != best && pivot_[c] < 0 && std::abs(work_[c]) > rounding_of_rows) r.rest.emplace_back(c, work_[c] / work_[best]);
      pivot_[best] = (int)rows_.size();
      rows_.push_back(std::move(r));
    }
    for (int c : touched) {
      work_[c] = 0;
      seen_[c] = 0;
    }
    return good;
  }
  static constexpr double rounding_of_rows = 1e-14; /* entries below this are rounding, since rows have norm one */
};

/* The rows of the core that depend on the others, in the order of the description */
std::vector<RowRef> Dependent(const SceneData &s, const std::vector<RowBlock> &blocks, const std::vector<RowRef> &core,
                              double threshold)
{
  std::vector<RowRef> found;
  if (core.empty()) return found;
  std::vector<std::pair<int, double>> row;
  std::vector<std::size_t>            redundant;
  std::vector<int>                    first(s.bodies.size() + 1, 0); /* first column of each body */
  for (std::size_t b = 0; b < s.bodies.size(); b++) first[b + 1] = first[b] + Width(s, (PetscInt)b);
  Elimination elimination(first.back());
  for (std::size_t j : EliminationOrder(blocks, core, s.bodies.size())) {
    const RowBlock &b = blocks[core[j].block];
    row.clear();
    for (std::size_t k = 0; k < b.body.size(); k++)
      for (int c = b.column[k]; c < b.column[k + 1]; c++)
        if (b.J(core[j].row, c) != 0) row.emplace_back(first[b.body[k]] + c - b.column[k], b.J(core[j].row, c));
    if (!elimination.add(row, threshold)) redundant.push_back(j);
  }
  std::sort(redundant.begin(), redundant.end());
  for (std::size_t k : redundant) found.push_back(core[k]);
  return found;
}

/* Redundant rows at the described poses */
std::vector<RowRef> FindRedundant(SceneData &s, std::vector<RowBlock> &blocks)
{
  Scale(s, blocks, LengthOfBodies(s));
  const std::vector<RowRef> core = Pruning(s, blocks).core();
  s.started.core                 = (PetscInt)core.size();
  /* linear dependences hold only as accurately as the constraints are satisfied */
  const double threshold = std::min(1e-5, std::max(rounding_of_descriptions, 100 * s.started.misfit));
  return Dependent(s, blocks, core, threshold);
}

/* Moves the bodies by neighbour_distance in a random direction that the constraints allow; *moved = false if they allow none */
PetscErrorCode MoveAside(Model &M, const std::vector<RowBlock> &blocks, bool *moved)
{
  SceneData                             &s    = M.scene;
  const double                           size = SceneSize(s);
  std::mt19937                           random(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  NearestSystem                          system(M);
  std::vector<double>                    from(6 * s.bodies.size(), 0), d, rhs;
  double                                 most = 0;
  PetscFunctionBegin;
  for (std::size_t i = 0; i < s.bodies.size(); i++) /* only directions in which the body can move; none out of the plane of a planar scene */
    for (int k : Directions(KindOf(s, s.bodies[i]))) from[6 * i + k] = uniform(random) * (k < 3 ? size : 1);
  for (const RowBlock &b : blocks) rhs.insert(rhs.end(), b.rows, 0.0);
  PetscCall(system.factor(blocks));
  PetscCall(system.solve(blocks, rhs, &from, d));
  for (std::size_t i = 0; i < d.size(); i++) most = std::max(most, std::abs(d[i]) / (i % 6 < 3 ? size : 1));
  *moved = most > 1e-6;
  if (!*moved) PetscFunctionReturn(0);
  for (std::size_t i = 0; i < s.bodies.size(); i++) {
    const Vector3 x(d[6 * i], d[6 * i + 1], d[6 * i + 2]), theta(d[6 * i + 3], d[6 * i + 4], d[6 * i + 5]);
    s.bodies[i].r += neighbour_distance / most * x;
    if (theta.norm() > 0)
      s.bodies[i].A = Eigen::AngleAxisd(neighbour_distance / most * theta.norm(), theta.normalized()) * s.bodies[i].A;
  }
  PetscFunctionReturn(0);
}

void SetActive(const std::vector<RowBlock> &blocks, const std::vector<RowRef> &rows, bool active)
{
  for (const RowRef &f : rows) {
    const RowBlock     &b   = blocks[f.block];
    const unsigned char now = b.store->active(b.instance), bit = (unsigned char)(1u << f.row);
    b.store->setActive(b.instance, (unsigned char)(active ? now | bit : now & ~bit));
  }
}

/* Largest violation of the rows at the present poses, with lengths in units of the scene's size */
double LargestMisfit(const SceneData &s, const std::vector<RowRef> &rows)
{
  const double                size   = SceneSize(s);
  const std::vector<RowBlock> blocks = DescribeAll(s, s.start.time, FixedBodies::None);
  double                      worst  = 0;
  for (const RowRef &f : rows) {
    const RowBlock &b = blocks[f.block];
    const double    x = b.holonomic ? std::abs(b.value(f.row)) / (b.length ? size : 1) : 0;
    if (!(x <= worst)) worst = x;
  }
  return worst;
}

/* Moves the bodies to a neighbouring position that satisfies all constraints, except those that need deformations
   (LeftToDeform()); redundant rows must be satisfied to 1e-3 of the tolerance. The first attempt leaves the redundant
   rows out, since they contradict the others near an inconsistent position; if they are violated then, a second attempt
   includes them. */
PetscErrorCode MoveToNeighbour(Model &M, const std::vector<RowBlock> &blocks, const std::vector<RowRef> &redundant,
                               bool *moved, bool *ok)
{
  SceneData              &s      = M.scene;
  const std::vector<Pose> before = Poses(s);
  const double            target   = 1e-3 * s.start.tolerance;
  const std::vector<char> elements = LeftToDeform(s) ? RigidElements(s, FixedBodies::None) : std::vector<char>(s.elements.size(), 1);
  PetscFunctionBegin;
  *ok = false;
  PetscCall(MoveAside(M, DescribeAll(s, s.start.time, FixedBodies::None), moved));
  if (!*moved) PetscFunctionReturn(0);
  const std::vector<Pose> aside = Poses(s);
  SetActive(blocks, redundant, false);
  const PetscErrorCode failed = ProjectPositions(M, FixedBodies::None, ok, &elements);
  SetActive(blocks, redundant, true);
  PetscCall(failed);
  *ok = *ok && LargestMisfit(s, redundant) <= target;
  if (*ok) PetscFunctionReturn(0);
  SetPoses(s, aside);
  PetscCall(ProjectPositions(M, FixedBodies::None, ok, &elements));
  *ok = *ok && LargestMisfit(s, redundant) <= target;
  if (!*ok) SetPoses(s, before);
  PetscFunctionReturn(0);
}

/* Removes rows from `found` that are independent at a neighbouring position */
PetscErrorCode KeepSingular(Model &M, const std::vector<RowBlock> &blocks, std::vector<RowRef> &found)
{
  SceneData              &s       = M.scene;
  const std::vector<Pose> before  = Poses(s);
  const StartResult       started = s.started;
  bool                    moved = false, ok = false;
  PetscFunctionBegin;
  PetscCall(MoveToNeighbour(M, blocks, found, &moved, &ok));
  if (ok) {
    std::vector<RowBlock>     there = DescribeAll(s, s.start.time, FixedBodies::None, ModalColumns::Included);
    const std::vector<RowRef> next  = FindRedundant(s, there);
    if (next.size() < found.size()) {
      PetscCall(TellOnce(s, "scene: the start is a singular position: " + std::to_string(found.size()) + " constraints are redundant there and " + std::to_string(next.size()) +
                              " next to it; a start elsewhere is safer\n"));
      found = next;
    }
  } else {
    const RowBlock &b = blocks[found[0].block];
    PetscCheck(
        !moved || s.start.redundant != Redundant::Drop, s.comm, PETSC_ERR_ARG_WRONG,
        "%zu of the constraints are redundant at the start, among them %s, but no neighbouring position satisfies all constraints:\n"
        "without the redundant ones the mechanism would move and violate them, with them it is locked. Change dimensions or "
        "positions, remove the constraints that lock it, or start from another position",
        found.size(), RowName(s, b.element, b.first + found[0].row, b.name).c_str());
    PetscCall(PetscInfo(nullptr, "scene: found no neighbouring position at which to test redundant constraints\n"));
  }
  SetPoses(s, before);
  s.started = started;
  PetscFunctionReturn(0);
}

PetscErrorCode ReportRedundant(SceneData &s, const std::vector<RowBlock> &blocks, const std::vector<RowRef> &found)
{
  const std::size_t max_named = 5;
  std::string       list;
  PetscFunctionBegin;
  for (std::size_t k = 0; k < found.size(); k++) {
    const RowBlock   &b    = blocks[found[k].block];
    const std::string name = RowName(s, b.element, b.first + found[k].row, b.name);
    if (k < max_named) list += "\n  " + name;
    PetscCall(PetscInfo(nullptr, "scene: redundant: %s\n", name.c_str()));
  }
  if (found.size() > max_named) list += "\n  and " + std::to_string(found.size() - max_named) + " more, see -info";
  PetscCheck(
      s.start.redundant == Redundant::Drop, s.comm, PETSC_ERR_ARG_WRONG,
      "%zu of %d constraints follow from the others:%s\nUse joints that leave more freedom, or -scene_redundant drop",
      found.size(), (int)s.started.rows, list.c_str());
  PetscCall(TellOnce(s, "scene: " + std::to_string(found.size()) + " redundant of " + std::to_string(s.started.rows) + " constraints dropped:" + list + "\n"));
  PetscFunctionReturn(0);
}

bool ReadsDroppedRow(const SceneData &s, const ElementData &e)
{
  for (const Part &p : e.parts)
    for (int i = 0; i < p.store->inputs(); i++) {
      const ScalarRef r = p.store->input(p.index, i);
      if (r.kind != ScalarRef::Multiplier) continue;
      for (const auto &d : s.started.dropped)
        if (d.element == r.id && d.row == r.component) return true;
    }
  return false;
}

/* Warns of friction elements that read the multiplier of a dropped row, which is zero because other joints carry the load */
PetscErrorCode WarnReaders(SceneData &s)
{
  PetscFunctionBegin;
  for (const ElementData &e : s.elements)
    if (ReadsDroppedRow(s, e))
      PetscCall(TellOnce(s, "scene: " + std::string(e.type) + " " + e.name + " takes the forces of dropped rows for zero. Attach it to the joint that carries the load, or use joints with more degrees of freedom\n"));
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode DropRedundant(Model &M)
{
  SceneData            &s      = M.scene;
  std::vector<RowBlock> blocks = DescribeAll(s, s.start.time, FixedBodies::None, ModalColumns::Included);
  PetscFunctionBegin;
  s.started.coordinates = s.started.rows = s.started.redundant = 0;
  s.started.dropped.clear();
  for (const BodyData &b : s.bodies) s.started.coordinates += CoordinatesOf(s, b);
  for (const auto &x : s.extensions) {
    PetscInt mine[2] = {x->coordinates(), x->multipliers()}, all[2];
    PetscCallMPI(MPI_Allreduce(mine, all, 2, MPIU_INT, MPI_SUM, s.comm));
    s.started.coordinates += all[0];
    s.started.rows += all[1];
  }
  for (const RowBlock &b : blocks)
    for (int r = 0; r < b.rows && !b.store->isExplicit(); r++) s.started.rows += b.has(r);
  if (s.start.redundant == Redundant::Keep) PetscFunctionReturn(0);
  std::vector<RowRef> found = FindRedundant(s, blocks);
  if (!found.empty()) PetscCall(KeepSingular(M, blocks, found));
  s.started.redundant = (PetscInt)found.size();
  if (found.empty()) PetscFunctionReturn(0);
  PetscCall(ReportRedundant(s, blocks, found));
  for (const RowRef &f : found) {
    const RowBlock &b = blocks[f.block];
    b.store->setActive(b.instance, (unsigned char)(b.store->active(b.instance) & ~(1u << f.row)));
    s.started.dropped.push_back({b.element, b.first + f.row});
  }
  PetscCall(WarnReaders(s));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
