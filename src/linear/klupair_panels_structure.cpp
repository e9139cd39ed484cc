/* Structure of the panels of "klupair": supernodes of the elimination tree, their cost, and the target of each matrix entry */
#if defined(HHTDAE_HAVE_KLU)
#include "klupair_panels_tree.h"
#include <algorithm>
#include <tuple>

typedef std::vector<PetscInt> Indices;
typedef KluPattern            Pattern;
typedef KluTree               Tree;

/* With fewer operations in all, or per entry of L and U, KLU is as fast, and panels are not tried (KluPairPanels.OnlyWhereTheyPay) */
static const double MIN_FLOPS = 5e4, MIN_FLOPS_PER_ENTRY = 15;

/*
  Costs in operations of a dense product: of KLU per operation and per entry of L and U; of panels per stored entry, per panel
  and per pair of a panel and one that contributes to it. Milliseconds of processor time with the matrices of
  tests/bench/linear_matrices.h, for a factorization with old pivots and one solve (Debian 12, KLU 1.3.8, OpenBLAS, one core):

      family, size               n   nz(L+U)  operations  per nz      KLU   solve    panels   solve
      chain in space, 1000   11000   1.8e+05     1.3e+06       7     1.20    0.18      1.79    0.27   not used
      rings of eight, 1000   11375   2.5e+05     2.6e+06      10     2.28    0.23      2.65    0.30   not used
      10 modes, 30 bodies      450   9.6e+03     1.0e+05      11    0.071   0.010     0.077   0.011   not used
      20 modes, 30 bodies      750   2.4e+04     4.1e+05      18     0.22   0.020      0.17   0.021
      10 bodies, 40 modes      450   2.3e+04     7.1e+05      31     0.31   0.018      0.16   0.013
      10 bodies, 120 modes    1250   1.6e+05     1.4e+07      84     4.99    0.13      1.43   0.050
      1 body, 80 modes          85   7.3e+03     4.1e+05      56     0.15   0.006     0.048   0.003
      1 body, 320 modes        325   1.1e+05     2.3e+07     215     7.33   0.085      1.16   0.022
      plate, 12 x 12 bricks   1092   1.4e+05     1.0e+07      74     3.64    0.11      0.89   0.049
      block, 4^3 bricks        450   5.2e+04     3.8e+06      74     1.32   0.040      0.43   0.020
      block, 8^3 bricks       2430   7.6e+05     1.6e+08     203       56     1.0       8.2    0.63
*/
static const double COST_KLU_OPERATION = 7, COST_KLU_ENTRY = 90;
static const double COST_ENTRY = 80, COST_PANEL = 1.1e4, COST_SOURCE = 3300;

/* Panels are used if their estimated cost is below this part of KLU's. Before KLU has factored anything, the cost of building
   them is added, in operations per stored entry. */
static const double MAX_COST_RATIO = 0.7, COST_BUILD_ENTRY = 440;

/* The last panel of a diagonal block is not merged with its children if it is at least this wide and has several: their contributions
   in one product with all other columns are faster than as part of the LU of a wider panel */
static const PetscInt WIDE_PANEL = 64;

/* Entries of a column with consecutive targets are copied as a block if there are at least this many */
static const PetscInt MIN_RUN = 8;

/* ---- panels ---- */

namespace
{

/* A range [first, last] of places that may become a panel */
struct Supernode {
  PetscInt first, last, rows; /* rows: number of later places that the last place fills */
  double   zeros;             /* zeros stored in `lower` and `upper` because structures were merged */
  bool     several_children;  /* more than one place has `first` for its parent */
};

} // namespace

/* Fundamental supernodes: consecutive places, each the only child of the next, whose structures differ by the place itself only */
static std::vector<Supernode> FundamentalSupernodes(const Indices &parent, const Indices &count)
{
  std::vector<Supernode> supernodes;
  const PetscInt         n = (PetscInt)parent.size();
  Indices                children(n, 0);
  for (PetscInt k = 0; k < n; ++k)
    if (parent[k] >= 0) ++children[parent[k]];
  for (PetscInt k = 0; k < n; ++k)
    if (k && children[k] == 1 && parent[k - 1] == k && count[k - 1] == count[k] + 1) {
      supernodes.back().last = k;
      supernodes.back().rows = count[k];
    } else
      supernodes.push_back({k, k, count[k], 0, children[k] > 1});
  return supernodes;
}

/* Merges a supernode with the following one, which contains its parent. Worthwhile if few zeros have to be stored; narrow supernodes may have a larger
   part of zeros. */
static bool CanMerge(const Supernode &a, const Supernode &b, Supernode *both)
{
  const double wa = (double)(a.last - a.first + 1), wb = (double)(b.last - b.first + 1), w = wa + wb;
  *both = {a.first, b.last, b.rows, a.zeros + b.zeros + 2 * wa * (wb + (double)(b.rows - a.rows)), a.several_children};
  if (b.several_children && b.rows == 0 && wb >= (double)WIDE_PANEL) return false;
  const double all = w * (w + 2 * (double)b.rows), part = both->zeros / all;
  return w <= 4 ? part < 0.6 : w <= 16 ? part < 0.25 : w <= 48 ? part < 0.1 : part < 0.05;
}

/* Relaxed supernodes, by merging from the last one to the first */
static std::vector<Supernode> Amalgamate(const std::vector<Supernode> &fundamental, const Indices &parent)
{
  std::vector<Supernode> supernodes; /* from the last to the first */
  for (size_t k = fundamental.size(); k-- > 0;) {
    Supernode both;
    if (!supernodes.empty() && parent[fundamental[k].last] >= 0 && parent[fundamental[k].last] <= supernodes.back().last &&
        CanMerge(fundamental[k], supernodes.back(), &both))
      supernodes.back() = both;
    else
      supernodes.push_back(fundamental[k]);
  }
  std::reverse(supernodes.begin(), supernodes.end());
  return supernodes;
}

static Indices NumberPanels(const KluPanels &p)
{
  Indices panel_of(p.n);
  for (size_t k = 0; k < p.panel.size(); ++k) std::fill_n(panel_of.begin() + p.panel[k].first, p.panel[k].width, (PetscInt)k);
  return panel_of;
}

/* Within a panel, pivots whose columns have the fewest entries outside of it go first: a later pivot does not fill these
   columns, and columns that stay zero need no products. Ties by column number, so that targets of matrix entries are consecutive. */
static void SortPlaces(const LinearRows &rows, const Indices &panel_of, KluPanels *p)
{
  typedef std::pair<PetscInt, std::pair<PetscInt, PetscInt>> Pivot; /* entries outside, column, row */
  Indices                                                   panel_of_row(p->n);
  std::vector<Pivot>                                        pivots;
  for (PetscInt k = 0; k < p->n; ++k) panel_of_row[p->row[k]] = panel_of[k];
  for (const KluPanel &q : p->panel) {
    pivots.clear();
    for (PetscInt k = q.first; k < q.first + q.width; ++k) {
      const PetscInt *first = rows.col + rows.start[p->col[k]], *last = rows.col + rows.start[p->col[k] + 1];
      const auto      outside = std::count_if(first, last, [&](PetscInt i) { return panel_of_row[i] != panel_of[k]; });
      pivots.push_back({(PetscInt)outside, {p->col[k], p->row[k]}});
    }
    std::sort(pivots.begin(), pivots.end());
    for (PetscInt k = 0; k < q.width; ++k) std::tie(p->col[q.first + k], p->row[q.first + k]) = pivots[k].second;
  }
}

/* ---- rows and columns that each panel reaches ---- */

namespace
{

/* Matrix entries by number and places */
struct Entry {
  PetscInt number, row, col;
};

struct Entries {
  std::vector<Entry> in_block, off_block; /* within diagonal blocks of KLU, and between them */
};

} // namespace

static Entries PlaceEntries(const LinearRows &rows, const Indices &block_of, const KluPanels &p)
{
  Entries e;
  Indices row(p.n), col(p.n);
  for (PetscInt k = 0; k < p.n; ++k) {
    row[p.row[k]] = k;
    col[p.col[k]] = k;
  }
  e.in_block.reserve(rows.start[rows.n]);
  for (PetscInt j = 0; j < rows.n; ++j)
    for (PetscInt k = rows.start[j]; k < rows.start[j + 1]; ++k) {
      const Entry entry = {k, row[rows.col[k]], col[j]};
      (block_of[entry.row] == block_of[entry.col] ? e.in_block : e.off_block).push_back(entry);
    }
  return e;
}

namespace
{

/* The places R and C of each panel, ascending, each once */
struct PanelReach {
  std::vector<Indices> rows, cols;
};

} // namespace

static void SortUnique(Indices *a)
{
  std::sort(a->begin(), a->end());
  a->erase(std::unique(a->begin(), a->end()), a->end());
}

/* Appends the places of `from` that lie after those of panel q */
static void AppendPlacesAfter(const Indices &from, const KluPanel &q, Indices *to)
{
  to->insert(to->end(), std::lower_bound(from.begin(), from.end(), q.first + q.width), from.end());
}

/* Calls use(panel) for every panel that has some of these ascending places */
template <typename Use> static void EachPanel(const Indices &places, const Indices &panel_of, Use use)
{
  PetscInt last = -1;
  for (PetscInt i : places) {
    if (panel_of[i] != last) use(panel_of[i]);
    last = panel_of[i];
  }
}

/* Appends the rows of a panel to the rows of each panel that has one of its columns; long lists are reduced to unique places at once to bound the memory */
static void PassToPanels(const Indices &rows, const Indices &cols, const Indices &panel_of, const KluPanels &p,
                         std::vector<Indices> *to)
{
  EachPanel(cols, panel_of, [&](PetscInt k) {
    Indices &r = (*to)[k];
    AppendPlacesAfter(rows, p.panel[k], &r);
    if (r.size() > 4 * (size_t)p.n) SortUnique(&r);
  });
}

static PanelReach FindReach(const Entries &e, const Indices &panel_of, const KluPanels &p)
{
  PanelReach r;
  r.rows.resize(p.panel.size());
  r.cols.resize(p.panel.size());
  for (const Entry &a : e.in_block)
    if (panel_of[a.row] > panel_of[a.col])
      r.rows[panel_of[a.col]].push_back(a.row);
    else if (panel_of[a.row] < panel_of[a.col])
      r.cols[panel_of[a.row]].push_back(a.col);
  for (size_t k = 0; k < p.panel.size(); ++k) {
    SortUnique(&r.rows[k]);
    SortUnique(&r.cols[k]);
    PassToPanels(r.rows[k], r.cols[k], panel_of, p, &r.rows);
    PassToPanels(r.cols[k], r.rows[k], panel_of, p, &r.cols);
  }
  return r;
}

static KluReach StoreReach(const Indices &places, KluPanels *p)
{
  const KluReach r = {(PetscInt)p->reached.size(), (PetscInt)places.size()};
  p->reached.insert(p->reached.end(), places.begin(), places.end());
  return r;
}

static void SizePanels(const PanelReach &reach, KluPanels *p)
{
  size_t values = 0;
  for (size_t k = 0; k < p->panel.size(); ++k) {
    KluPanel &q    = p->panel[k];
    q.rows         = StoreReach(reach.rows[k], p);
    q.cols         = StoreReach(reach.cols[k], p);
    q.lower        = values;
    q.upper        = q.lower + (size_t)q.width * (size_t)(q.width + q.rows.count);
    values         = q.upper + (size_t)q.width * (size_t)q.cols.count;
    const double w = (double)q.width, l = (double)q.rows.count, u = (double)q.cols.count;
    p->flops += 2.0 / 3 * w * w * w + w * w * (l + u) + 2 * w * l * u;
  }
  p->off_block_values = values;
  p->entries          = (double)values;
}

static PetscInt PositionOf(const Indices &places, PetscInt place)
{
  return (PetscInt)(std::lower_bound(places.begin(), places.end(), place) - places.begin());
}

/* The panels that contribute to each panel */
static void FindSources(const PanelReach &reach, const Indices &panel_of, KluPanels *p)
{
  std::vector<std::vector<KluPanelSource>> found(p->panel.size());
  for (size_t k = 0; k < p->panel.size(); ++k) {
    const Indices &r = reach.rows[k], &c = reach.cols[k];
    const auto     add = [&](PetscInt to) {
      const PetscInt first = p->panel[to].first, end = first + p->panel[to].width;
      if (found[to].empty() || found[to].back().panel != (PetscInt)k)
        found[to].push_back({(PetscInt)k, PositionOf(r, first), PositionOf(r, end), PositionOf(c, first), PositionOf(c, end)});
    };
    EachPanel(r, panel_of, add);
    EachPanel(c, panel_of, add);
  }
  for (size_t k = 0; k < p->panel.size(); ++k) {
    p->panel[k].source  = (PetscInt)p->source.size();
    p->panel[k].sources = (PetscInt)found[k].size();
    p->source.insert(p->source.end(), found[k].begin(), found[k].end());
  }
}

/* ---- targets of the matrix entries ---- */

void KluPanelsSetPlaces(const KluPanel &q, KluPanels *p)
{
  for (PetscInt i = 0; i < q.width; ++i) p->row_of[q.first + i] = p->col_of[q.first + i] = i;
  for (PetscInt i = 0; i < q.rows.count; ++i) p->row_of[p->reached[q.rows.start + i]] = q.width + i;
  for (PetscInt i = 0; i < q.cols.count; ++i) p->col_of[p->reached[q.cols.start + i]] = q.width + i;
}

static size_t Position(const KluPanel &q, const KluPanels &p, const Entry &e)
{
  if (e.col < q.first + q.width)
    return q.lower + (size_t)(e.col - q.first) * (size_t)(q.width + q.rows.count) + (size_t)p.row_of[e.row];
  return q.upper + (size_t)(e.row - q.first) * (size_t)q.cols.count + (size_t)(p.col_of[e.col] - q.width);
}

/* Entries are sorted by panels first, so that KluPanelsSetPlaces() is called once for each panel */
static void SetInnerTargets(const std::vector<Entry> &entries, const Indices &panel_of, KluPanels *p)
{
  Indices            start(p->panel.size() + 1, 0);
  std::vector<Entry> by_panel(entries.size());
  const auto         panel = [&panel_of](const Entry &e) { return std::min(panel_of[e.row], panel_of[e.col]); };
  for (const Entry &e : entries) ++start[panel(e) + 1];
  for (size_t k = 0; k < p->panel.size(); ++k) start[k + 1] += start[k];
  Indices next(start.begin(), start.end() - 1);
  for (const Entry &e : entries) by_panel[next[panel(e)]++] = e;
  for (size_t k = 0; k < p->panel.size(); ++k) {
    KluPanelsSetPlaces(p->panel[k], p);
    for (PetscInt e = start[k]; e < start[k + 1]; ++e)
      p->target[by_panel[e].number] = (PetscInt)Position(p->panel[k], *p, by_panel[e]);
  }
}

static void SetOuterTargets(const std::vector<Entry> &entries, KluPanels *p)
{
  p->off_block_start.assign(p->n + 1, 0);
  for (const Entry &e : entries) ++p->off_block_start[e.col + 1];
  for (PetscInt k = 0; k < p->n; ++k) p->off_block_start[k + 1] += p->off_block_start[k];
  p->off_block.resize(entries.size());
  Indices next(p->off_block_start.begin(), p->off_block_start.end() - 1);
  for (const Entry &e : entries) {
    p->off_block[next[e.col]] = e.row;
    p->target[e.number]       = (PetscInt)p->off_block_values + next[e.col]++;
  }
}

/* Entries of a column with consecutive targets, all within diagonal blocks */
static void FindRuns(const LinearRows &rows, KluPanels *p)
{
  const auto inside = [p](PetscInt e) { return (size_t)p->target[e] < p->off_block_values; };
  p->run_start.assign(1, 0);
  for (PetscInt k = 0; k < p->n; ++k) {
    const PetscInt end = rows.start[p->col[k] + 1];
    for (PetscInt e = rows.start[p->col[k]], last; e < end; e = last) {
      for (last = e + 1; last < end && inside(last) && p->target[last] == p->target[last - 1] + 1;) ++last;
      if (last - e >= MIN_RUN && inside(e)) p->run.push_back({e, last - e});
    }
    p->run_start.push_back((PetscInt)p->run.size());
  }
}

/* ---- assembly of the structure ---- */

static void EstimateCost(double entries, double flops, KluPanels *p)
{
  p->klu_cost   = COST_KLU_OPERATION * flops + COST_KLU_ENTRY * entries;
  p->panel_cost = p->flops + COST_ENTRY * p->entries + COST_PANEL * (double)p->panel.size() + COST_SOURCE * (double)p->source.size();
}

static void OrderPivots(const KluPair &k, const Indices &order, KluPanels *p, Indices *block_of)
{
  Indices       block(p->n);
  const KluInt *row = k.numeric ? k.numeric->Pnum : k.symbolic->P;
  p->row.resize(p->n);
  p->col.resize(p->n);
  block_of->resize(p->n);
  for (KluInt b = 0; b < k.symbolic->nblocks; ++b)
    std::fill(block.begin() + k.symbolic->R[b], block.begin() + k.symbolic->R[b + 1], (PetscInt)b);
  for (PetscInt i = 0; i < p->n; ++i) {
    p->row[i]      = row[order[i]];
    p->col[i]      = k.symbolic->Q[order[i]];
    (*block_of)[i] = block[order[i]];
  }
}

static void MakePanels(const std::vector<Supernode> &supernodes, const Indices &block_of, KluPanels *p)
{
  for (size_t i = 0; i < supernodes.size(); ++i) {
    KluPanel q = KluPanel();
    q.first    = supernodes[i].first;
    q.width    = supernodes[i].last - supernodes[i].first + 1;
    p->panel.push_back(q);
    if (!i || block_of[q.first] != block_of[q.first - 1]) p->block.push_back((PetscInt)i);
  }
  p->block.push_back((PetscInt)supernodes.size());
}

static std::vector<Supernode> FindSupernodes(const Tree &tree, const Indices &order)
{
  const PetscInt n = (PetscInt)order.size();
  Indices        place(n), parent(n), count(n);
  for (PetscInt i = 0; i < n; ++i) place[order[i]] = i;
  for (PetscInt i = 0; i < n; ++i) {
    parent[i] = tree.parent[order[i]] < 0 ? -1 : place[tree.parent[order[i]]];
    count[i]  = (PetscInt)tree.structure[order[i]].size();
  }
  return Amalgamate(FundamentalSupernodes(parent, count), parent);
}

static void Allocate(const LinearRows &rows, KluPanels *p)
{
  p->target.resize(rows.start[rows.n]);
  for (auto *scratch : {&p->row_of, &p->col_of, &p->exchange}) scratch->resize(p->n);
  for (auto *scratch : {&p->matrix_size, &p->factor_size, &p->x, &p->y}) scratch->resize(p->n);
  for (auto *zero : {&p->zero_lower, &p->zero_upper}) zero->resize(p->n);
}

static bool WorthTrying(double entries, double flops)
{
  return flops > MIN_FLOPS && flops > MIN_FLOPS_PER_ENTRY * entries && entries < 0.1 * PETSC_MAX_INT;
}

/* entries, flops: of KLU's factors, for the comparison of costs */
static void Build(const LinearRows &rows, const KluPair &k, const Pattern &pattern, double entries, double flops,
                  KluPanels *p, bool *pays)
{
  Tree    tree;
  Indices block_of;

  p->n  = rows.n;
  *pays = KluTreeEliminate(pattern, 3 * entries, &tree);
  if (!*pays) return;
  const Indices order = KluTreePostorder(tree);
  OrderPivots(k, order, p, &block_of);
  MakePanels(FindSupernodes(tree, order), block_of, p);
  const Indices panel_of = NumberPanels(*p);
  SortPlaces(rows, panel_of, p);
  const Entries    e     = PlaceEntries(rows, block_of, *p);
  const PanelReach reach = FindReach(e, panel_of, *p);
  SizePanels(reach, p);
  FindSources(reach, panel_of, p);
  EstimateCost(entries, flops, p);
  *pays = p->panel_cost < MAX_COST_RATIO * p->klu_cost && p->entries < 0.5 * PETSC_MAX_INT;
  if (!k.numeric && p->panel_cost + COST_BUILD_ENTRY * p->entries > p->klu_cost) *pays = false;
  if (!*pays) return;
  Allocate(rows, p);
  SetInnerTargets(e.in_block, panel_of, p);
  SetOuterTargets(e.off_block, p);
  FindRuns(rows, p);
  p->value.resize(p->off_block_values + p->off_block.size());
}

PetscErrorCode KluPanelsBuild(const LinearRows &rows, KluPair *k, KluPanels *p, bool *pays)
{
  Pattern      pattern;
  const double entries = (double)k->numeric->lnz + (double)k->numeric->unz, flops = k->common.flops;

  PetscFunctionBegin;
  *p    = KluPanels();
  *pays = WorthTrying(entries, flops);
  if (!*pays) PetscFunctionReturn(0);
  PetscCall(KluPatternExtract(k, &pattern));
  Build(rows, *k, pattern, entries, flops, p, pays);
  PetscFunctionReturn(0);
}

void KluPanelsPlan(const LinearRows &rows, const KluPair &k, KluPanels *p, bool *pays)
{
  const double entries = 2 * k.work.factor, flops = 2 * k.work.flops;

  *p    = KluPanels();
  *pays = WorthTrying(entries, flops) && COST_KLU_OPERATION * flops > COST_BUILD_ENTRY * entries;
  if (*pays) Build(rows, k, KluPatternPlanned(rows, k), entries, flops, p, pays);
}

#endif
