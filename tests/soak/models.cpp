static char help[] =
    "Random models of rigid and flexible bodies, run with default settings, each against an independent reference.\n"
    "  -seed <1>: of the models; -first <0>, -count <2000>: which of them\n"
    "  -small: models of few bodies alone; -switches <true>: stiff elements that let go or take hold, in two of five "
    "models\n"
    "  -extras <false>: stops, ropes, links without mass and joints by expressions in each model\n"
    "  -again <true>: each model is described and run a second time, a checkpoint written and gone on from\n"
    "  -laws <true>: every body is held to the laws of Newton and Euler\n"
    "  -jobs <2>: processes at a time; -deadline <120>: CPU seconds for one model with its references\n"
    "  -output <build/soak>: .csv and .html are added; none: no files\n"
    "One model alone, with messages and any option of the integrator: models -seed s -first k -count 1 -ts_view\n"
    "Ends with an error if a model is wrong, crashes or hangs, or if less than 99.5 % are finished.\n";

#include "hhtdae/flexible.h"
#include "hhtdae/scene.h"
#include "model_report.h"

using namespace soak;

static PetscErrorCode Run(bool *passed)
{
  PetscInt                 seed = 1, first = 0, count = 2000, jobs = 2;
  PetscReal                deadline = 120;
  PetscBool                small = PETSC_FALSE, switches = PETSC_TRUE, extras = PETSC_FALSE, again = PETSC_TRUE, laws = PETSC_TRUE;
  char                     output[PETSC_MAX_PATH_LEN] = "build/soak";
  std::vector<ReducedPart> parts;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetInt(nullptr, nullptr, "-seed", &seed, nullptr));
  PetscCall(PetscOptionsGetInt(nullptr, nullptr, "-first", &first, nullptr));
  PetscCall(PetscOptionsGetInt(nullptr, nullptr, "-count", &count, nullptr));
  PetscCall(PetscOptionsGetInt(nullptr, nullptr, "-jobs", &jobs, nullptr));
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-deadline", &deadline, nullptr));
  PetscCall(PetscOptionsGetBool(nullptr, nullptr, "-small", &small, nullptr));
  PetscCall(PetscOptionsGetBool(nullptr, nullptr, "-switches", &switches, nullptr));
  PetscCall(PetscOptionsGetBool(nullptr, nullptr, "-extras", &extras, nullptr));
  PetscCall(PetscOptionsGetBool(nullptr, nullptr, "-again", &again, nullptr));
  PetscCall(PetscOptionsGetBool(nullptr, nullptr, "-laws", &laws, nullptr));
  PetscCall(PetscOptionsGetString(nullptr, nullptr, "-output", output, sizeof output, nullptr));
  PetscCheck(count > 0 && jobs > 0 && deadline > 0, PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE,
             "-count, -jobs and -deadline must be positive");
#ifndef HHTDAE_HAVE_IDA
  PetscCall(PetscPrintf(PETSC_COMM_SELF, "built without SUNDIALS IDA: every reference is hhtdae's own\n"));
#endif
  PetscCall(MakeParts(&parts));

  const bool   one = count == 1;
  Pool         pool((int)count);
  const Choice choice{(bool)small, (bool)switches, (bool)extras};
  Report       report((long)seed, choice, (int)count);
  PetscCall(
      pool.run((long)first, (int)jobs, deadline, !one,
               [&](Outcome *o) { Judge((std::uint64_t)seed, o->number, choice, again, laws, parts, one, o).run(); },
               [&](const Outcome &o, int done) { report.progress(o, done); }));
  for (int k = 0; k < pool.size(); k++) report.add(pool[k]);
  report.print();
  if (std::string(output) != "none" && !one) PetscCall(report.write(output));
  *passed = report.passed();
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  bool passed = false;
  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, nullptr, help));
  PetscCall(TSHHT3Initialize());
  PetscCall(Run(&passed));
  PetscCall(PetscFinalize());
  return passed ? 0 : 1;
}
