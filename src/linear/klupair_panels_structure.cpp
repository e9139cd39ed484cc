/* Structure of the panels of "klupair": from the elimination tree to panels, what they cost, where entries go */
#if defined(HHTDAE_HAVE_KLU)
#include "klupair_panels_tree.h"
#include <algorithm>
#include <tuple>

typedef std::vector<PetscInt> Indices;
typedef KluPattern            Pattern;
typedef KluTree               Tree;

/* Below so many operations in all, or per entry of L and U, KLU is as fast and nobody looks for panels */
static const double LEAST_FLOPS = 5e4, LEAST_PER_ENTRY = 15;

/*
  Costs in operations of a dense product: of KLU per operation and per entry of L and U; of the panels per entry stored, per panel
  and per panel that one looks back to. Milliseconds of processor time with the matrices of tests/bench/linear_matrices.h,
  for a factorization with old pivots and one solve (Debian 12, KLU 1.3.8, OpenBLAS, one core):

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
static const double KLU_OPERATION = 7, KLU_ENTRY = 90;
static const double ENTRY = 80, PANEL = 1.1e4, SOURCE = 3300;

/* Panels must promise this part of KLU's cost. Before KLU has factored anything, what it costs per entry to build them
   counts, too. */
static const double GAIN = 0.7, BUILD = 440;

/* At the end of a diagonal block, a panel so wide that several others contribute to takes in none of them: their product
   with all the others' columns is faster than their part in the factors of a wider panel */
static const PetscInt WIDE = 64;

/* Entries that go to places one after the other are copied together from so many on */
static const PetscInt RUN = 8;

/* ---- panels ---- */

namespace
{

/* Ranges of places; all of `block` begin one, too */
struct Range {
  PetscInt first, last, rows; /* with so many places after the last */
  double   zeros;
  bool     junction; /* several places have the first one for their parent */
};

} // namespace

/* Pivots in a row of which each reaches the next one and what that reaches, and nothing else reaches the next one first */
static std::vector<Range> Fundamental(const Indices &parent, const Indices &count)
{
  std::vector<Range> ranges;
  const PetscInt     n = (PetscInt)parent.size();
  Indices            children(n, 0);
  for (PetscInt k = 0; k < n; ++k)
    if (parent[k] >= 0) ++children[parent[k]];
  for (PetscInt k = 0; k < n; ++k)
    if (k && children[k] == 1 && parent[k - 1] == k && count[k - 1] == count[k] + 1) {
      ranges.back().last = k;
      ranges.back().rows = count[k];
    } else
      ranges.push_back({k, k, count[k], 0, children[k] > 1});
  return ranges;
}

/* A range taken together with the one that follows, if that is its parent: worth it where few zeros are stored or both
   are narrow */
static bool Joined(const Range &a, const Range &b, Range *both)
{
  const double wa = (double)(a.last - a.first + 1), wb = (double)(b.last - b.first + 1), w = wa + wb;
  *both            = {a.first, b.last, b.rows, a.zeros + b.zeros + 2 * wa * (wb + (double)(b.rows - a.rows)), a.junction};
  if (b.junction && b.rows == 0 && wb >= (double)WIDE) return false;
  const double all = w * (w + 2 * (double)b.rows), part = both->zeros / all;
  return w <= 4 ? part < 0.6 : w <= 16 ? part < 0.25 : w <= 48 ? part < 0.1 : part < 0.05;
}

static std::vector<Range> Amalgamate(const std::vector<Range> &fine, const Indices &parent)
{
  std::vector<Range> ranges; /* from the last to the first */
  for (size_t k = fine.size(); k-- > 0;) {
    Range both;
    if (!ranges.empty() && parent[fine[k].last] >= 0 && parent[fine[k].last] <= ranges.back().last &&
        Joined(fine[k], ranges.back(), &both))
      ranges.back() = both;
    else
      ranges.push_back(fine[k]);
  }
  std::reverse(ranges.begin(), ranges.end());
  return ranges;
}

static Indices PanelOf(const KluPanels &p)
{
  Indices of(p.n);
  for (size_t k = 0; k < p.panel.size(); ++k) std::fill_n(of.begin() + p.panel[k].first, p.panel[k].width, (PetscInt)k);
  return of;
}

/* Within a panel, pivots whose columns have the fewest entries outside of it go first: what a later pivot leaves there
   does not fill them, and columns that stay zero need no products. Otherwise by number, so that entries lie together. */
static void SortPlaces(const LinearRows &rows, const Indices &of, KluPanels *p)
{
  typedef std::pair<PetscInt, std::pair<PetscInt, PetscInt>> Pivot; /* entries outside, column, row */
  Indices                                                   panel_of_row(p->n);
  std::vector<Pivot>                                        pivots;
  for (PetscInt k = 0; k < p->n; ++k) panel_of_row[p->row[k]] = of[k];
  for (const KluPanel &q : p->panel) {
    pivots.clear();
    for (PetscInt k = q.first; k < q.first + q.width; ++k) {
      const PetscInt *first = rows.col + rows.start[p->col[k]], *last = rows.col + rows.start[p->col[k] + 1];
      const auto      outside = std::count_if(first, last, [&](PetscInt i) { return panel_of_row[i] != of[k]; });
      pivots.push_back({(PetscInt)outside, {p->col[k], p->row[k]}});
    }
    std::sort(pivots.begin(), pivots.end());
    for (PetscInt k = 0; k < q.width; ++k) std::tie(p->col[q.first + k], p->row[q.first + k]) = pivots[k].second;
  }
}

/* ---- rows and columns that each panel reaches ---- */

namespace
{

/* Entries of the matrix, as places, inside of diagonal blocks or between them */
struct Entry {
  PetscInt number, row, col;
};

struct Entries {
  std::vector<Entry> inner, outer;
};

} // namespace

static Entries Place(const LinearRows &rows, const Indices &block_of, const KluPanels &p)
{
  Entries e;
  Indices row(p.n), col(p.n);
  for (PetscInt k = 0; k < p.n; ++k) {
    row[p.row[k]] = k;
    col[p.col[k]] = k;
  }
  e.inner.reserve(rows.start[rows.n]);
  for (PetscInt j = 0; j < rows.n; ++j)
    for (PetscInt k = rows.start[j]; k < rows.start[j + 1]; ++k) {
      const Entry entry = {k, row[rows.col[k]], col[j]};
      (block_of[entry.row] == block_of[entry.col] ? e.inner : e.outer).push_back(entry);
    }
  return e;
}

namespace
{

/* What the panels before hand over to one panel, sorted, each once */
struct Reach {
  std::vector<Indices> rows, cols;
};

} // namespace

static void SortUnique(Indices *a)
{
  std::sort(a->begin(), a->end());
  a->erase(std::unique(a->begin(), a->end()), a->end());
}

/* Appends what lies after the places of panel q */
static void Append(const Indices &from, const KluPanel &q, Indices *to)
{
  to->insert(to->end(), std::lower_bound(from.begin(), from.end(), q.first + q.width), from.end());
}

/* Calls use(panel) for every panel that has some of these ascending places */
template <typename Use> static void EachPanel(const Indices &places, const Indices &of, Use use)
{
  PetscInt last = -1;
  for (PetscInt i : places) {
    if (of[i] != last) use(of[i]);
    last = of[i];
  }
}

/* Places met again and again are sorted out early, before a panel's turn comes */
static void Spread(const Indices &rows, const Indices &cols, const Indices &of, const KluPanels &p,
                   std::vector<Indices> *to)
{
  EachPanel(cols, of, [&](PetscInt k) {
    Indices &r = (*to)[k];
    Append(rows, p.panel[k], &r);
    if (r.size() > 4 * (size_t)p.n) SortUnique(&r);
  });
}

static Reach FindReach(const Entries &e, const Indices &of, const KluPanels &p)
{
  Reach r;
  r.rows.resize(p.panel.size());
  r.cols.resize(p.panel.size());
  for (const Entry &a : e.inner)
    if (of[a.row] > of[a.col])
      r.rows[of[a.col]].push_back(a.row);
    else if (of[a.row] < of[a.col])
      r.cols[of[a.row]].push_back(a.col);
  for (size_t k = 0; k < p.panel.size(); ++k) {
    SortUnique(&r.rows[k]);
    SortUnique(&r.cols[k]);
    Spread(r.rows[k], r.cols[k], of, p, &r.rows);
    Spread(r.cols[k], r.rows[k], of, p, &r.cols);
  }
  return r;
}

static KluReach Store(const Indices &places, KluPanels *p)
{
  const KluReach r = {(PetscInt)p->reached.size(), (PetscInt)places.size()};
  p->reached.insert(p->reached.end(), places.begin(), places.end());
  return r;
}

static void SizePanels(const Reach &reach, KluPanels *p)
{
  size_t values = 0;
  for (size_t k = 0; k < p->panel.size(); ++k) {
    KluPanel &q    = p->panel[k];
    q.rows         = Store(reach.rows[k], p);
    q.cols         = Store(reach.cols[k], p);
    q.lower        = values;
    q.upper        = q.lower + (size_t)q.width * (size_t)(q.width + q.rows.count);
    values         = q.upper + (size_t)q.width * (size_t)q.cols.count;
    const double w = (double)q.width, l = (double)q.rows.count, u = (double)q.cols.count;
    p->flops += 2.0 / 3 * w * w * w + w * w * (l + u) + 2 * w * l * u;
  }
  p->outer_values = values;
  p->entries      = (double)values;
}

static PetscInt Find(const Indices &places, PetscInt place)
{
  return (PetscInt)(std::lower_bound(places.begin(), places.end(), place) - places.begin());
}

/* Which panels each one looks back to */
static void FindSources(const Reach &reach, const Indices &of, KluPanels *p)
{
  std::vector<std::vector<KluPanelSource>> found(p->panel.size());
  for (size_t k = 0; k < p->panel.size(); ++k) {
    const Indices &r = reach.rows[k], &c = reach.cols[k];
    const auto     add = [&](PetscInt to) {
      const PetscInt first = p->panel[to].first, end = first + p->panel[to].width;
      if (found[to].empty() || found[to].back().panel != (PetscInt)k)
        found[to].push_back({(PetscInt)k, Find(r, first), Find(r, end), Find(c, first), Find(c, end)});
    };
    EachPanel(r, of, add);
    EachPanel(c, of, add);
  }
  for (size_t k = 0; k < p->panel.size(); ++k) {
    p->panel[k].source  = (PetscInt)p->source.size();
    p->panel[k].sources = (PetscInt)found[k].size();
    p->source.insert(p->source.end(), found[k].begin(), found[k].end());
  }
}

/* ---- where the entries of the matrix go ---- */

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

/* Entries are dealt out to the panels that hold them first, so that places are set once for each panel */
static void AimInner(const std::vector<Entry> &entries, const Indices &of, KluPanels *p)
{
  Indices            start(p->panel.size() + 1, 0);
  std::vector<Entry> dealt(entries.size());
  const auto         panel = [&of](const Entry &e) { return std::min(of[e.row], of[e.col]); };
  for (const Entry &e : entries) ++start[panel(e) + 1];
  for (size_t k = 0; k < p->panel.size(); ++k) start[k + 1] += start[k];
  Indices next(start.begin(), start.end() - 1);
  for (const Entry &e : entries) dealt[next[panel(e)]++] = e;
  for (size_t k = 0; k < p->panel.size(); ++k) {
    KluPanelsSetPlaces(p->panel[k], p);
    for (PetscInt e = start[k]; e < start[k + 1]; ++e)
      p->target[dealt[e].number] = (PetscInt)Position(p->panel[k], *p, dealt[e]);
  }
}

static void AimOuter(const std::vector<Entry> &entries, KluPanels *p)
{
  p->outer_start.assign(p->n + 1, 0);
  for (const Entry &e : entries) ++p->outer_start[e.col + 1];
  for (PetscInt k = 0; k < p->n; ++k) p->outer_start[k + 1] += p->outer_start[k];
  p->outer.resize(entries.size());
  Indices next(p->outer_start.begin(), p->outer_start.end() - 1);
  for (const Entry &e : entries) {
    p->outer[next[e.col]] = e.row;
    p->target[e.number]   = (PetscInt)p->outer_values + next[e.col]++;
  }
}

/* Entries of a column that go to places one after the other, all inside of diagonal blocks */
static void FindRuns(const LinearRows &rows, KluPanels *p)
{
  const auto inside = [p](PetscInt e) { return (size_t)p->target[e] < p->outer_values; };
  p->run_start.assign(1, 0);
  for (PetscInt k = 0; k < p->n; ++k) {
    const PetscInt end = rows.start[p->col[k] + 1];
    for (PetscInt e = rows.start[p->col[k]], last; e < end; e = last) {
      for (last = e + 1; last < end && inside(last) && p->target[last] == p->target[last - 1] + 1;) ++last;
      if (last - e >= RUN && inside(e)) p->run.push_back({e, last - e});
    }
    p->run_start.push_back((PetscInt)p->run.size());
  }
}

/* ---- all together ---- */

static void Estimate(double entries, double flops, KluPanels *p)
{
  p->klu_cost = KLU_OPERATION * flops + KLU_ENTRY * entries;
  p->cost     = p->flops + ENTRY * p->entries + PANEL * (double)p->panel.size() + SOURCE * (double)p->source.size();
}

static void Order(const KluPair &k, const Indices &order, KluPanels *p, Indices *block_of)
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

static void MakePanels(const std::vector<Range> &ranges, const Indices &block_of, KluPanels *p)
{
  for (size_t i = 0; i < ranges.size(); ++i) {
    KluPanel q = KluPanel();
    q.first    = ranges[i].first;
    q.width    = ranges[i].last - ranges[i].first + 1;
    p->panel.push_back(q);
    if (!i || block_of[q.first] != block_of[q.first - 1]) p->block.push_back((PetscInt)i);
  }
  p->block.push_back((PetscInt)ranges.size());
}

static std::vector<Range> Ranges(const Tree &tree, const Indices &order)
{
  const PetscInt n = (PetscInt)order.size();
  Indices        place(n), parent(n), count(n);
  for (PetscInt i = 0; i < n; ++i) place[order[i]] = i;
  for (PetscInt i = 0; i < n; ++i) {
    parent[i] = tree.parent[order[i]] < 0 ? -1 : place[tree.parent[order[i]]];
    count[i]  = (PetscInt)tree.structure[order[i]].size();
  }
  return Amalgamate(Fundamental(parent, count), parent);
}

static void Allocate(const LinearRows &rows, KluPanels *p)
{
  p->target.resize(rows.start[rows.n]);
  for (auto *scratch : {&p->row_of, &p->col_of, &p->exchange}) scratch->resize(p->n);
  for (auto *scratch : {&p->matrix_size, &p->factor_size, &p->x, &p->y}) scratch->resize(p->n);
  for (auto *zero : {&p->zero_lower, &p->zero_upper}) zero->resize(p->n);
}

static bool WorthALook(double entries, double flops)
{
  return flops > LEAST_FLOPS && flops > LEAST_PER_ENTRY * entries && entries < 0.1 * PETSC_MAX_INT;
}

/* For factors of KLU with so many entries and operations */
static void Build(const LinearRows &rows, const KluPair &k, const Pattern &pattern, double entries, double flops,
                  KluPanels *p, bool *pays)
{
  Tree    tree;
  Indices block_of;

  p->n  = rows.n;
  *pays = KluTreeEliminate(pattern, 3 * entries, &tree);
  if (!*pays) return;
  const Indices order = KluTreePostorder(tree);
  Order(k, order, p, &block_of);
  MakePanels(Ranges(tree, order), block_of, p);
  const Indices of = PanelOf(*p);
  SortPlaces(rows, of, p);
  const Entries e     = Place(rows, block_of, *p);
  const Reach   reach = FindReach(e, of, *p);
  SizePanels(reach, p);
  FindSources(reach, of, p);
  Estimate(entries, flops, p);
  *pays = p->cost < GAIN * p->klu_cost && p->entries < 0.5 * PETSC_MAX_INT;
  if (!k.numeric && p->cost + BUILD * p->entries > p->klu_cost) *pays = false;
  if (!*pays) return;
  Allocate(rows, p);
  AimInner(e.inner, of, p);
  AimOuter(e.outer, p);
  FindRuns(rows, p);
  p->value.resize(p->outer_values + p->outer.size());
}

PetscErrorCode KluPanelsBuild(const LinearRows &rows, KluPair *k, KluPanels *p, bool *pays)
{
  Pattern      pattern;
  const double entries = (double)k->numeric->lnz + (double)k->numeric->unz, flops = k->common.flops;

  PetscFunctionBegin;
  *p    = KluPanels();
  *pays = WorthALook(entries, flops);
  if (!*pays) PetscFunctionReturn(0);
  PetscCall(KluPatternExtract(k, &pattern));
  Build(rows, *k, pattern, entries, flops, p, pays);
  PetscFunctionReturn(0);
}

void KluPanelsPlan(const LinearRows &rows, const KluPair &k, KluPanels *p, bool *pays)
{
  const double entries = 2 * k.work.factor, flops = 2 * k.work.flops;

  *p    = KluPanels();
  *pays = WorthALook(entries, flops) && KLU_OPERATION * flops > BUILD * entries;
  if (*pays) Build(rows, k, KluPatternPlanned(rows, k), entries, flops, p, pays);
}

#endif
