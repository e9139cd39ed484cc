/*
  Constraints that say the same thing twice.

  A body whose rows are independent in its own columns takes part in no redundancy, and neither do its rows: it is cut
  off, then its neighbours are looked at again. Trees vanish in this way. What is left, loops that may be redundant,
  goes through a sparse elimination, row by row in a fill-reducing order of the elements: rows that vanish are
  redundant. (Sparse QR is some hundred times slower on nets of loops.) Every rank has the description and computes the
  same.

  Rows are made comparable: lengths in units of the scene's size, modal coordinates in the same by the body's mass (SmallBodies.Attachments), each row of
  norm one.

  At a singular position rows are dependent that are not elsewhere. So where redundant rows are found they are looked
  for again at a neighbouring position that satisfies the constraints, and only those that are redundant there too are
  dropped.
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

constexpr double clearly_independent = 1e-3; /* least pivot for a body to be cut off */
constexpr double neighbour           = 0.02; /* how far away: radians, parts of the scene's size */

/* Dimensions and directions are given to some seven digits: rows whose independence is less than this are dependent as far as the description tells. With 1e-9 a hinge that
   was 1e-8 rad out of line locked a linkage, without a word and by any moment (SceneRedundant.AHingeSlightlyOutOfLine). What is dropped has to hold at a neighbouring position, too. */
constexpr double rounding_of_descriptions = 1e-6;

using Sparse = Eigen::SparseMatrix<double, Eigen::ColMajor, int>;

struct RowRef {
  std::size_t block;
  int         row;
};

/* Scaled rows: lengths in units of the scene's size, modal coordinates in those in which they move the body's mass as far, norm one */
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

/* A length by which translations and rotations compare: the scene's size, but not far beyond the bodies' own, where a small mechanism is far from the origin or from others */
double LengthOfBodies(const SceneData &s)
{
  double arm = 0, size = SceneSize(s);
  for (std::size_t m = 0; m < s.ownMarkers(); m++)
    if (s.markers[m].body >= 0) arm = std::max(arm, s.markers[m].s.norm());
  return arm > 0 ? std::min(size, 10 * arm) : size;
}

/* The rows left after trees have been cut off, in the order of the blocks */
class Pruning
{
public:
  Pruning(const SceneData &s, const std::vector<RowBlock> &blocks)
      : s_(s), blocks_(blocks), at_(s.bodies.size()), open_(blocks.size())
  {
    for (std::size_t k = 0; k < blocks.size(); k++) {
      open_[k] = blocks[k].active & ((1u << blocks[k].rows) - 1);
      for (PetscInt b : blocks[k].body) at_[b].push_back(k);
    }
    std::vector<char>    queued(s.bodies.size(), 1);
    std::deque<PetscInt> queue;
    for (std::size_t b = 0; b < s.bodies.size(); b++) queue.push_back((PetscInt)b);
    while (!queue.empty()) {
      const PetscInt b = queue.front();
      queue.pop_front();
      queued[b] = 0;
      for (std::size_t k : cut(b))
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
  std::vector<std::vector<std::size_t>> at_; /* blocks at each body */
  std::vector<unsigned>                 open_;

  /* Blocks that lost rows because their rows at body b are independent in b's columns */
  std::vector<std::size_t> cut(PetscInt b)
  {
    const int           width = Width(s_, b);
    std::vector<RowRef> rows;
    for (std::size_t k : at_[b]) {
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

/* Order of elimination: fill is kept small by COLAMD on elements and bodies, within an element positions come before
   directions, for what comes last is what gets dropped */
std::vector<std::size_t> EliminationOrder(const std::vector<RowBlock> &blocks, const std::vector<RowRef> &core,
                                          std::size_t bodies)
{
  std::vector<std::size_t>            first; /* of the rows of an element */
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
                        [&](std::size_t e) { return blocks[core[first[e]].block].store->everIndependent(); });
  for (std::size_t e : place)
    for (bool length : {true, false})
      for (std::size_t k = first[e]; k < (e + 1 < first.size() ? first[e + 1] : core.size()); k++)
        if (blocks[core[k].block].length == length) order.push_back(k);
  return order;
}

/*
  Gaussian elimination of one sparse row after the other, each with its largest remaining entry as the pivot: a row of
  which nothing remains is a combination of those before it.
*/
class Elimination
{
public:
  explicit Elimination(int columns) : pivot_(columns, -1), work_(columns, 0.0), seen_(columns, 0) {}

  /* false if the row depends on those that were taken */
  bool take(const std::vector<std::pair<int, double>> &row, double threshold)
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
  std::vector<int>                                              pivot_; /* row of which a column is the pivot */
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
        if (c != best && pivot_[c] < 0 && std::abs(work_[c]) > drop) r.rest.emplace_back(c, work_[c] / work_[best]);
      pivot_[best] = (int)rows_.size();
      rows_.push_back(std::move(r));
    }
    for (int c : touched) {
      work_[c] = 0;
      seen_[c] = 0;
    }
    return good;
  }
  static constexpr double drop = 1e-14; /* rounding of rows of norm one */
};

/* Which rows of the core depend on the others, in the order of the description */
std::vector<RowRef> Dependent(const SceneData &s, const std::vector<RowBlock> &blocks, const std::vector<RowRef> &core,
                              double threshold)
{
  std::vector<RowRef> found;
  if (core.empty()) return found;
  std::vector<std::pair<int, double>> row;
  std::vector<std::size_t>            dead;
  std::vector<int>                    first(s.bodies.size() + 1, 0); /* column */
  for (std::size_t b = 0; b < s.bodies.size(); b++) first[b + 1] = first[b] + Width(s, (PetscInt)b);
  Elimination elimination(first.back());
  for (std::size_t j : EliminationOrder(blocks, core, s.bodies.size())) {
    const RowBlock &b = blocks[core[j].block];
    row.clear();
    for (std::size_t k = 0; k < b.body.size(); k++)
      for (int c = b.column[k]; c < b.column[k + 1]; c++)
        if (b.J(core[j].row, c) != 0) row.emplace_back(first[b.body[k]] + c - b.column[k], b.J(core[j].row, c));
    if (!elimination.take(row, threshold)) dead.push_back(j);
  }
  std::sort(dead.begin(), dead.end());
  for (std::size_t k : dead) found.push_back(core[k]);
  return found;
}

/* Redundant rows where the description puts the bodies */
std::vector<RowRef> Find(SceneData &s, std::vector<RowBlock> &blocks)
{
  Scale(s, blocks, LengthOfBodies(s));
  const std::vector<RowRef> core = Pruning(s, blocks).core();
  s.started.core                 = (PetscInt)core.size();
  /* rows that are redundant are so to the accuracy to which the constraints are met */
  const double threshold = std::min(1e-5, std::max(rounding_of_descriptions, 100 * s.started.misfit));
  return Dependent(s, blocks, core, threshold);
}

/* Moves the bodies a little in a direction that the constraints allow; false if they allow none */
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
  for (std::size_t i = 0; i < s.bodies.size(); i++) /* none out of the plane of a planar scene */
    for (int k : Directions(KindOf(s, s.bodies[i]))) from[6 * i + k] = uniform(random) * (k < 3 ? size : 1);
  for (const RowBlock &b : blocks) rhs.insert(rhs.end(), b.rows, 0.0);
  PetscCall(system.factor(blocks));
  PetscCall(system.solve(blocks, rhs, &from, d));
  for (std::size_t i = 0; i < d.size(); i++) most = std::max(most, std::abs(d[i]) / (i % 6 < 3 ? size : 1));
  *moved = most > 1e-6;
  if (!*moved) PetscFunctionReturn(0);
  for (std::size_t i = 0; i < s.bodies.size(); i++) {
    const Vector3 x(d[6 * i], d[6 * i + 1], d[6 * i + 2]), theta(d[6 * i + 3], d[6 * i + 4], d[6 * i + 5]);
    s.bodies[i].r += neighbour / most * x;
    if (theta.norm() > 0)
      s.bodies[i].A = Eigen::AngleAxisd(neighbour / most * theta.norm(), theta.normalized()) * s.bodies[i].A;
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

/* Largest misfit of rows where the bodies are, lengths in units of the scene's size */
double LargestMisfit(const SceneData &s, const std::vector<RowRef> &rows)
{
  const double                size   = SceneSize(s);
  const std::vector<RowBlock> blocks = DescribeAll(s, s.start.time, Hold::None);
  double                      worst  = 0;
  for (const RowRef &f : rows) {
    const RowBlock &b = blocks[f.block];
    const double    x = b.holonomic ? std::abs(b.value(f.row)) / (b.length ? size : 1) : 0;
    if (!(x <= worst)) worst = x;
  }
  return worst;
}

/* To a neighbouring position that all constraints are met at, but for those that flexible bodies have yet to deform for, redundant ones to less than what a start may be off.
   Found without the redundant ones, which near a position that is not consistent contradict the others; where that
   leads away from them, with them */
PetscErrorCode Neighbour(Model &M, const std::vector<RowBlock> &blocks, const std::vector<RowRef> &redundant,
                         bool *moved, bool *ok)
{
  SceneData              &s      = M.scene;
  const std::vector<Pose> before = Poses(s);
  const double            enough = 1e-3 * s.start.tolerance;
  const std::vector<char> part   = LeftToDeform(s) ? RigidElements(s, Hold::None) : std::vector<char>(s.elements.size(), 1);
  PetscFunctionBegin;
  *ok = false;
  PetscCall(MoveAside(M, DescribeAll(s, s.start.time, Hold::None), moved));
  if (!*moved) PetscFunctionReturn(0);
  const std::vector<Pose> aside = Poses(s);
  SetActive(blocks, redundant, false);
  const PetscErrorCode failed = ProjectPositions(M, Hold::None, ok, &part);
  SetActive(blocks, redundant, true);
  PetscCall(failed);
  *ok = *ok && LargestMisfit(s, redundant) <= enough;
  if (*ok) PetscFunctionReturn(0);
  SetPoses(s, aside);
  PetscCall(ProjectPositions(M, Hold::None, ok, &part));
  *ok = *ok && LargestMisfit(s, redundant) <= enough;
  if (!*ok) SetPoses(s, before);
  PetscFunctionReturn(0);
}

/* Takes the rows out of `found` that are independent next to the start */
PetscErrorCode KeepSingular(Model &M, const std::vector<RowBlock> &blocks, std::vector<RowRef> &found)
{
  SceneData              &s       = M.scene;
  const std::vector<Pose> before  = Poses(s);
  const StartResult       started = s.started;
  bool                    moved = false, ok = false;
  PetscFunctionBegin;
  PetscCall(Neighbour(M, blocks, found, &moved, &ok));
  if (ok) {
    std::vector<RowBlock>     there = DescribeAll(s, s.start.time, Hold::None, Modes::Free);
    const std::vector<RowRef> next  = Find(s, there);
    if (next.size() < found.size()) {
      PetscCall(PetscPrintf(
          s.comm,
          "scene: the start is a singular position: %zu constraints are redundant there and %zu next to it; "
          "a start elsewhere is safer\n",
          found.size(), next.size()));
      found = next;
    }
  } else {
    const RowBlock &b = blocks[found[0].block];
    PetscCheck(
        !moved || s.start.redundant != Redundant::Drop, s.comm, PETSC_ERR_ARG_WRONG,
        "%zu of the constraints are redundant at the start, among them %s, but next to it no position meets them "
        "all:\nwithout them the mechanism would move away from them, with them it is locked. Mend dimensions or "
        "positions, leave out what locks it, or start elsewhere",
        found.size(), RowName(s, b.element, b.first + found[0].row, b.name).c_str());
    PetscCall(PetscInfo(nullptr, "scene: no neighbouring position to test redundant constraints at\n"));
  }
  SetPoses(s, before);
  s.started = started;
  PetscFunctionReturn(0);
}

PetscErrorCode Tell(const SceneData &s, const std::vector<RowBlock> &blocks, const std::vector<RowRef> &found)
{
  const std::size_t named = 5;
  std::string       list;
  PetscFunctionBegin;
  for (std::size_t k = 0; k < found.size(); k++) {
    const RowBlock   &b    = blocks[found[k].block];
    const std::string name = RowName(s, b.element, b.first + found[k].row, b.name);
    if (k < named) list += "\n  " + name;
    PetscCall(PetscInfo(nullptr, "scene: redundant: %s\n", name.c_str()));
  }
  if (found.size() > named) list += "\n  and " + std::to_string(found.size() - named) + " more, see -info";
  PetscCheck(
      s.start.redundant == Redundant::Drop, s.comm, PETSC_ERR_ARG_WRONG,
      "%zu of %d constraints follow from the others:%s\nUse joints that leave more freedom, or -scene_redundant drop",
      found.size(), (int)s.started.rows, list.c_str());
  PetscCall(PetscPrintf(s.comm, "scene: %zu redundant of %d constraints dropped:%s\n", found.size(),
                        (int)s.started.rows, list.c_str()));
  PetscFunctionReturn(0);
}

bool ReadsDropped(const SceneData &s, const ElementData &e)
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

/* Friction whose joint has lost rows finds no load there: the other joints carry it */
PetscErrorCode TellReaders(const SceneData &s)
{
  PetscFunctionBegin;
  for (const ElementData &e : s.elements)
    if (ReadsDropped(s, e))
      PetscCall(PetscPrintf(s.comm, "scene: %s %s takes the forces of dropped rows for zero: put it on the joint that is left to carry the load, or use joints that leave more freedom\n",
                            e.type, e.name.c_str()));
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode DropRedundant(Model &M)
{
  SceneData            &s      = M.scene;
  std::vector<RowBlock> blocks = DescribeAll(s, s.start.time, Hold::None, Modes::Free);
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
  std::vector<RowRef> found = Find(s, blocks);
  if (!found.empty()) PetscCall(KeepSingular(M, blocks, found));
  s.started.redundant = (PetscInt)found.size();
  if (found.empty()) PetscFunctionReturn(0);
  PetscCall(Tell(s, blocks, found));
  for (const RowRef &f : found) {
    const RowBlock &b = blocks[f.block];
    b.store->setActive(b.instance, (unsigned char)(b.store->active(b.instance) & ~(1u << f.row)));
    s.started.dropped.push_back({b.element, b.first + f.row});
  }
  PetscCall(TellReaders(s));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
