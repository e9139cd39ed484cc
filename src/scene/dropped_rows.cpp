/*
  Checks rows that were dropped as redundant at the start. The remaining rows imply them only as long as the mechanism stays
  on the branch of motion on which they were redundant, and dimensions, motions and functions are consistent. So dropped rows
  are evaluated after every accepted step and after every analysis; a violation is an error.
*/
#include "measures.h"
#include "runtime.h"
#include "start.h"

namespace hhtdae
{

struct DroppedRows {
  struct Row {
    int    number; /* index in StartResult::dropped */
    int    probe, row;
    double speed = 0; /* for rows at velocity level: largest sum of the magnitudes of their terms so far */
  };
  std::vector<std::unique_ptr<Probe>> probes;
  std::vector<bool>                   holonomic;
  std::vector<Row>                    rows;
  double                              size = 1; /* of the scene */
};

namespace
{

/* Updates the memories of dropped rows: angles over full turns and points on curves */
class DroppedBatch : public Batch
{
public:
  explicit DroppedBatch(std::shared_ptr<DroppedRows> d) : dropped_(std::move(d)) {}

  void pattern(Pattern &) override {}
  void residual(Evaluation &) override {}
  void jacobian(Evaluation &) override {}
  void accept(Bodies &B) override
  {
    for (auto &p : dropped_->probes) p->accept(B);
  }
  PetscInt memory() const override
  {
    PetscInt n = 0;
    for (const auto &p : dropped_->probes) n += p->memory();
    return n;
  }
  void copyMemory(double *x, bool in) override
  {
    for (auto &p : dropped_->probes) {
      p->copyMemory(x, in);
      x += p->memory();
    }
  }

private:
  std::shared_ptr<DroppedRows> dropped_;
};

/* The worst row of a rank; ratio: violation relative to the allowed one */
struct WorstRow {
  double ratio  = 0;
  int    number = -1;
  double violation = 0; /* a length, an angle in radians, or the rate of one */
};

/* Allowed violation, from the larger of the tolerances of start and run: near a singular position the remaining rows
   imply a dropped one with no greater accuracy (DroppedRows.ANetAndBricardsMechanism). unit: the scene's size, a speed,
   or 1 for angles */
double Allowed(const Runtime &R, double unit) { return std::max(std::max(R.scene.start.tolerance, R.tolerance_of[1]) * unit, R.tolerance_of[0]); }

WorstRow FindWorst(const Runtime &R, const Evaluation &e)
{
  DroppedRows  &d = *R.dropped;
  DescribedRows rows;
  double        speed[DescribedRows::max_rows] = {};
  WorstRow      worst;
  int           described = -1;
  for (DroppedRows::Row &r : d.rows) {
    if (r.probe != described) d.probes[r.probe]->rows(e, rows, speed);
    described          = r.probe;
    r.speed            = std::max(r.speed, speed[r.row]);
    const double unit  = !d.holonomic[r.probe] ? r.speed : rows.length ? d.size : 1, x = std::abs(rows.value[r.row]);
    const double ratio = x == 0 ? 0 : std::isfinite(x) ? x / Allowed(R, unit) : INFINITY;
    if (ratio > worst.ratio) worst = {ratio, r.number, x};
  }
  return worst;
}

} // namespace

PetscErrorCode LocalizeDropped(Runtime &R, Localizer &l)
{
  const auto &all = R.scene.started.dropped;
  PetscFunctionBegin;
  R.dropped.reset();
  if (all.empty()) PetscFunctionReturn(0);
  auto        d    = std::make_shared<DroppedRows>();
  const Part *last = nullptr;
  for (std::size_t k = 0; k < all.size(); k++) {
    PetscInt    row = all[k].row;
    const Part *p   = FindPart(R.scene, all[k].element, true, row);
    if (p->store->isExplicit() || OwnerOf(*R.model, *p->store, p->index) != R.rank) continue;
    if (p != last) {
      d->probes.push_back(p->store->probe(l, p->index));
      d->holonomic.push_back(p->store->isHolonomic());
    }
    last = p;
    d->rows.push_back({(int)k, (int)d->probes.size() - 1, (int)row});
  }
  d->size   = SceneSize(R.scene);
  R.dropped = d;
  R.batches.push_back(std::make_unique<DroppedBatch>(d));
  PetscFunctionReturn(0);
}

PetscErrorCode CheckDropped(Runtime &R, PetscReal t, Vec U, Vec V)
{
  const double *u, *v, *local[3];
  WorstRow      worst;
  struct {
    double ratio;
    int    rank;
  } mine, all;
  PetscFunctionBegin;
  if (!R.dropped) PetscFunctionReturn(0);
  PetscCall(VecGetArrayRead(U, &u));
  PetscCall(VecGetArrayRead(V, &v));
  PetscCall(LocalState(R, u, v, v, local));
  R.bodies.move(local[0], local[1]);
  worst = FindWorst(R, Evaluation{t, local[0], local[1], local[2], R.bodies, R.n});
  PetscCall(VecRestoreArrayRead(U, &u));
  PetscCall(VecRestoreArrayRead(V, &v));
  mine = all = {worst.ratio, R.rank};
  if (R.size > 1) PetscCallMPI(MPI_Allreduce(&mine, &all, 1, MPI_DOUBLE_INT, MPI_MAXLOC, R.scene.comm));
  PetscCall(PetscInfo(nullptr, "scene: dropped rows at t = %g: %g of what is allowed\n", (double)t, all.ratio));
  if (all.ratio <= 1) PetscFunctionReturn(0);
  if (R.size > 1) PetscCallMPI(MPI_Bcast(&worst.number, 1, MPI_INT, all.rank, R.scene.comm));
  if (R.size > 1) PetscCallMPI(MPI_Bcast(&worst.violation, 1, MPI_DOUBLE, all.rank, R.scene.comm));
  const auto &row  = R.scene.started.dropped[worst.number];
  PetscInt      part = row.row;
  const Part   *p    = FindPart(R.scene, row.element, true, part);
  DescribedRows d;
  p->store->describe(R.scene, p->index, R.scene.start.time, d);
  SETERRQ(R.scene.comm, PETSC_ERR_ARG_WRONG,
          "%s was dropped as redundant at the start, and is violated by %.3g at t = %g: in the present position, or with the present values of motions, the other constraints do "
          "not imply it.\nChange dimensions, positions or motions so that they are consistent, remove this constraint, or start from another position",
          RowName(R.scene, row.element, row.row, d.name).c_str(), worst.violation, (double)t);
}

} // namespace hhtdae
