/*
  -scene_balance: energy and momentum after every step, as a check of the run. The total is constant where nothing but springs,
  bushings, beams and gravity does work: dampers, friction, contact, motions and users' forces change it, and so does the numerical
  damping of the integrator.
*/
#include "scene/output/energy.h"
#include "scene/output/recorder.h"
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
  ~BalanceSheet() override
  {
    if (out_) std::fclose(out_);
  }

  PetscErrorCode open(Runtime &R, const std::string &file)
  {
    PetscFunctionBegin;
    writes_ = R.rank == 0;
    if (!writes_) PetscFunctionReturn(0);
    if (!file.empty()) {
      out_ = std::fopen(file.c_str(), "w");
      PetscCheck(out_, PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN, "cannot write the balance into %s", file.c_str());
    }
    PetscCall(line("time,kinetic,gravity,elastic,total,drift,px,py,pz,Lx,Ly,Lz"));
    PetscFunctionReturn(0);
  }

  PetscErrorCode record(Runtime &R, Evaluation &e) override
  {
    Balance b;
    PetscFunctionBegin;
    PetscCall(MakeBalance(R, e, b));
    if (done == 0) {
      first_ = b;
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
    if (out_) std::fflush(out_);
    if (done == 0) PetscFunctionReturn(0);
    PetscCall(PetscPrintf(R.scene.comm, "balance: energy=%.9g drift=%.3e largest_kinetic=%.3e momentum_change=%.3e angular_momentum_change=%.3e\n",
                          first_.total(), worst_, largest_kinetic_, linear_, angular_));
    PetscFunctionReturn(0);
  }

private:
  bool    writes_ = false;
  FILE   *out_    = nullptr; /* none: printed */
  Balance first_;
  double  worst_ = 0, largest_kinetic_ = 0, linear_ = 0, angular_ = 0;

  PetscErrorCode line(const char *text)
  {
    PetscFunctionBegin;
    if (out_) std::fprintf(out_, "%s\n", text);
    else PetscCall(PetscPrintf(PETSC_COMM_SELF, "%s\n", text));
    PetscFunctionReturn(0);
  }
};

} // namespace

PetscErrorCode MakeBalanceSheet(Runtime &R, const OutputSettings &o, std::unique_ptr<Task> &task)
{
  PetscFunctionBegin;
  if (!o.balance) PetscFunctionReturn(0);
  auto b = std::make_unique<BalanceSheet>();
  PetscCall(b->open(R, o.balance_file));
  task = std::move(b);
  PetscFunctionReturn(0);
}

} // namespace hhtdae
