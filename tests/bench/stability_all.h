/* All cases of the table of stability. */
#ifndef HHTDAE_BENCH_STABILITY_ALL_H
#define HHTDAE_BENCH_STABILITY_ALL_H

#include "stability_catch.h"
#include "stability_condition.h"
#include "stability_constraints.h"
#include "stability_events.h"
#include "stability_faults.h"
#include "stability_release.h"
#include "stability_rotation.h"
#include "stability_start.h"
#include "stability_stiff.h"

namespace hhtstab
{

inline Cases AllCases(const ConditionReport &report = {})
{
  Cases cases;
  AddSprings(cases);
  AddModes(cases);
  AddMasses(cases);
  AddRedundant(cases);
  AddSingular(cases);
  AddImpacts(cases);
  AddJumps(cases);
  AddReleases(cases);
  AddCatches(cases);
  AddWrongJacobians(cases);
  AddStarts(cases);
  AddSteps(cases);
  AddRotation(cases);
  AddFaults(cases);
  AddRange(cases);
  AddConditions(cases, report);
  AddMillion(cases);
  return cases;
}

} // namespace hhtstab

#endif
