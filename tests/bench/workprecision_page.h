/* The page of the comparison: runs, pictures, tables, and the costs of variations of hhtdae's settings */
#ifndef WORKPRECISION_PAGE_H
#define WORKPRECISION_PAGE_H

#include "workprecision_plot.h"
#include "workprecision_tables.h"

namespace wp
{

struct PageSetting {
  std::string out, command;
  bool        pictures = false;
  double      seconds  = 0.;
  int         repeats  = 1;
  double      limit    = 0.;
};

inline void addIntroduction(hhtbench::Page &page, const PageSetting &s, const Results &r)
{
  page.text(Text("CPU time of the solve alone against the largest weighted error over the output points, for %d "
                 "problems and %d solvers, all in "
                 "turn in one process on one core. The time of a run is the median of up to %d repetitions; a run is "
                 "given up after %g s. "
                 "Everything together took %.0f s of CPU time. Weights are 1/max(1, running maximum) of each unknown.",
                 (int)(Scenes(r, false).size() + Scenes(r, true).size()), (int)r.solvers.size(), s.repeats, s.limit,
                 s.seconds));
  page.code(s.command);
  page.text("A number in a table is a ratio of CPU times at the same error, read off the curves by interpolation; "
            "below 1 the solver is faster "
            "than hhtdae with its defaults. Ratios stand where both curves reach the error. What a solver loses in "
            "failed runs does not "
            "show in its ratios: see the column of failures.");
}

inline void addSolvers(hhtbench::Page &page, const Results &r)
{
  Table t;
  t.caption = "Solvers";
  t.head    = {"name", "what it is"};
  for (const Solver &solver : r.solvers) {
    std::string title = solver.title;
    for (size_t at; (at = title.find("{/Symbol a}")) != std::string::npos;) title.replace(at, 11, "alpha");
    t.rows.push_back({solver.name, title});
  }
  t.addTo(page);
  page.text("BDF and IDA solve the equations in first-order form, with analytic Jacobians; velocities (but in ida_v) "
            "and multipliers are out of "
            "their error test, as in Adams' GSTIFF. ida_v tests velocities too. The first step of IDA is set, because "
            "its own is so "
            "short at tight tolerances that rounding makes it fail.");
}

inline PetscErrorCode addGroup(hhtbench::Page &page, const Results &r, bool scene, const PageSetting &s)
{
  const Group       group = Scenes(r, scene);
  const std::string what  = scene ? "Scenes" : "Hand-written problems";

  PetscFunctionBegin;
  if (group.empty()) PetscFunctionReturn(0);
  page.section(what);
  if (scene) {
    page.text("Models of the example programs, through the scene library. hhtdae and ALPHA2 run on the scene's own TS. "
              "BDF and IDA get the "
              "same residual and Jacobian through an adapter, and pay more for them than a code written around these "
              "methods would: the "
              "stabilized index 2 form needs the constraints' gradient in every residual, which the scene gives only "
              "as part of a whole "
              "Jacobian, and the iteration matrix takes two to four evaluations of the scene's Jacobian, because "
              "velocities are unknowns of "
              "their own. The index 3 forms need no gradient in the residual. So the stabilized forms are better "
              "compared in the other group.");
    originTable(r).addTo(page);
    page.text("The reference is IDA's at 1e-11; itself: difference to IDA at 1e-10; hhtdae: difference to hhtdae at "
              "1e-8, which falls with its "
              "tolerance. Multipliers of the reference are made consistent with its positions and velocities. Errors "
              "below three times the "
              "first difference are not compared.");
  } else
    page.text("Equations written by hand, with exact or tabulated references. A residual costs next to nothing, so "
              "that this is where the "
              "integrators' own work shows.");
  if (s.pictures)
    PetscCall(page.picture(s.out + "/" + overviewName(scene), what + ": CPU time against error of the positions"));
  for (int kind = 0; kind < 3; kind++) summaryTable(r, group, kind, what).addTo(page);
  if (scene) {
    page.text("The same with the time of the adapter's additional evaluations of the Jacobian taken off BDF's and "
              "IDA's, as if a scene gave the "
              "gradient of its constraints and the three parts of its Jacobian for nothing: the least that these codes "
              "could take. The "
              "rest is theirs: more unknowns per step, and the linear algebra of these.");
    summaryTable(r, group, 0, what, Time::WithoutAdapter).addTo(page);
  }
  byProblemTable(r, group, 0, what).addTo(page);
  PetscFunctionReturn(0);
}

/* Variations of the defaults, one at a time; rows that repeat the default show the variation between repetitions */
inline void addSweep(hhtbench::Page &page, const Results &sweep)
{
  page.section("hhtdae's own settings");
  page.text("Each setting by itself against the defaults, over fewer tolerances. Rows that repeat a default (c=0.001, "
            "degree=-1, "
            "reuse=1.4/0.25/1.2, alpha=-0.3) show how far repetitions differ: nothing below that is a difference. c: "
            "when the corrector stops; "
            "degree: of the predictor, -1 chosen on the fly; reuse: largest change of h that keeps the matrix / rate "
            "of convergence that "
            "asks for a new one / change of h that is not taken; alpha and radius: damping.");
  for (int scene = 0; scene < 2; scene++) {
    const Group group = Scenes(sweep, scene);
    for (int kind = 0; kind < 3 && !group.empty(); kind++)
      summaryTable(sweep, group, kind, scene ? "Scenes" : "Hand-written problems").addTo(page);
  }
  failureTable(sweep).addTo(page);
}

inline PetscErrorCode WritePage(const Results &r, const Results &sweep, const PageSetting &s)
{
  hhtbench::Page page("Error against run time");

  PetscFunctionBegin;
  addIntroduction(page, s, r);
  addSolvers(page, r);
  PetscCall(addGroup(page, r, false, s));
  PetscCall(addGroup(page, r, true, s));
  page.section("Failures");
  failureTable(r).addTo(page);
  if (!sweep.solvers.empty()) addSweep(page, sweep);
  PetscCall(page.write(s.out + "/report.html"));
  printf("\nreport: %s/report.html\n", s.out.c_str());
  PetscFunctionReturn(0);
}

} // namespace wp

#endif
