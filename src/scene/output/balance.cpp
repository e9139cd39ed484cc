/*
  -scene_balance: energy and momentum after every step, as a check of the run. The total energy is constant if only springs,
  bushings, beams and gravity do work. Dampers, friction, contact, motions, users' forces and the numerical
  damping of the integrator change it.
*/
#include "scene/output/energy.h"
#include "scene/output/recorder.h"
#include "scene/output/table.h"
#include <algorithm>
#include <cmath>
#include <cstdio>

namespace hhtdae
{

namespace
{

class BalanceSheet : public Task
{
public:
  BalanceSheet() : Task(0) {}

  void begin(Runtime &R, const std::string &file)
  {
    writes_ = R.rank == 0;
    file_   = file;
  }

  PetscErrorCode record(Runtime &R, Evaluation &e) override
  {
    Balance b;
    PetscFunctionBegin;
    PetscCall(MakeBalance(R, e, b));
    if (!begun_) {
      begun_ = true;
      PetscCall(line("time,kinetic,gravity,elastic,total,drift,px,py,pz,Lx,Ly,Lz"));
    }
    if (!have_first_ || done == 0) {
      have_first_ = true;
      first_      = b;
      worst_ = largest_kinetic_ = linear_ = angular_ = 0;
    }
    const double drift = b.total() - first_.total();
    if (!(std::abs(drift) <= std::abs(worst_))) worst_ = drift;
    largest_kinetic_ = std::max(largest_kinetic_, b.kinetic);
    linear_          = std::max(linear_, (b.linear - first_.linear).norm());
    angular_         = std::max(angular_, (b.angular - first_.angular).norm());
    if (writes_) {
      char text[256];
      std::snprintf(text, sizeof text, "%.9g,%.9g,%.9g,%.9g,%.9g,%.3e,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g", e.t, b.kinetic, b.gravity, b.elastic, b.total(),
                    drift, b.linear(0), b.linear(1), b.linear(2), b.angular(0), b.angular(1), b.angular(2));
      PetscCall(line(text));
    }
    PetscFunctionReturn(0);
  }

  PetscErrorCode finish(Runtime &R) override
  {
    PetscFunctionBegin;
    PetscCall(flush());
    if (!have_first_) PetscFunctionReturn(0);
    PetscCall(PetscPrintf(R.scene.comm, "balance: energy=%.9g drift=%.3e largest_kinetic=%.3e momentum_change=%.3e angular_momentum_change=%.3e\n",
                          first_.total(), worst_, largest_kinetic_, linear_, angular_));
    PetscFunctionReturn(0);
  }

  int slot() const override { return 2; }

  PetscErrorCode save(Runtime &, double *x) override
  {
    PetscFunctionBegin;
    PetscCall(flush());
    const double all[task_numbers] = {first_.kinetic,    first_.gravity,    first_.elastic,    first_.linear(0), first_.linear(1), first_.linear(2), first_.angular(0), first_.angular(1),
                                      first_.angular(2), worst_,            largest_kinetic_, linear_,          angular_,         (double)end_,     (double)have_first_};
    std::copy(all, all + task_numbers, x);
    PetscFunctionReturn(0);
  }

  PetscErrorCode resume(Runtime &, const double *x) override
  {
    PetscFunctionBegin;
    first_.kinetic   = x[0];
    first_.gravity   = x[1];
    first_.elastic   = x[2];
    first_.linear    = {x[3], x[4], x[5]};
    first_.angular   = {x[6], x[7], x[8]};
    worst_           = x[9];
    largest_kinetic_ = x[10];
    linear_          = x[11];
    angular_         = x[12];
    end_             = (long)x[13];
    have_first_      = x[14] != 0;
    if (writes_ && !file_.empty() && end_ > 0) PetscCall(ShortenFile(file_, end_, &there_));
    begun_ = there_;
    PetscFunctionReturn(0);
  }

private:
  static constexpr std::size_t max_buffered_bytes = 1 << 16; /* buffered lines are written when they have this many bytes */

  bool        writes_ = false, begun_ = false, have_first_ = false; /* begun_: the head line has been written */
  /* file_: empty if the balance is printed; text_: lines that are not yet in the file */
  std::string file_, text_;
  bool        there_ = false;                                       /* whether the file exists */
  long        end_   = 0;                                           /* its length in bytes */
  Balance     first_;
  double      worst_ = 0, largest_kinetic_ = 0, linear_ = 0, angular_ = 0;

  PetscErrorCode line(const char *text)
  {
    PetscFunctionBegin;
    if (!writes_) PetscFunctionReturn(0);
    if (file_.empty()) {
      PetscCall(PetscPrintf(PETSC_COMM_SELF, "%s\n", text));
      PetscFunctionReturn(0);
    }
    text_ += text;
    text_ += '\n';
    /* the first line is written at once, so that a file that cannot be written is reported at the start */
    if (text_.size() >= max_buffered_bytes || !there_) PetscCall(flush());
    PetscFunctionReturn(0);
  }

  PetscErrorCode flush()
  {
    PetscFunctionBegin;
    if (!writes_ || text_.empty()) PetscFunctionReturn(0);
    PetscCall(AppendText(file_, !there_, text_, &end_));
    there_ = true;
    text_.clear();
    PetscFunctionReturn(0);
  }
};

} // namespace

PetscErrorCode MakeBalanceSheet(Runtime &R, const OutputSettings &o, std::unique_ptr<Task> &task)
{
  PetscFunctionBegin;
  if (!o.balance) PetscFunctionReturn(0);
  auto b = std::make_unique<BalanceSheet>();
  b->begin(R, o.balance_file);
  task = std::move(b);
  PetscFunctionReturn(0);
}

} // namespace hhtdae
