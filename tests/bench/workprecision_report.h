/* The results: CSV, the table of time at equal error, pictures by gnuplot. */
#ifndef WORKPRECISION_REPORT_H
#define WORKPRECISION_REPORT_H

#include "workprecision_cases.h"

#include <cstdio>
#include <map>

namespace wp
{

/* One solver on one problem over all tolerances */
struct Curve {
  std::vector<double> eps;
  std::vector<Run>    runs;
};

struct Results {
  std::vector<Case>               cases;
  std::vector<Solver>             solvers;
  std::vector<std::vector<Curve>> curve; /* [case][solver] */
};

/* CPU time at which a curve reaches an error, log-log between the first two points that bracket it; NaN outside */
inline double timeAtError(const Curve &c, int kind, double target)
{
  const Run *before = nullptr;
  for (const Run &r : c.runs) {
    if (!r.failure.empty() || !(r.error[kind] > 0.)) continue;
    if (before && before->error[kind] >= target && r.error[kind] < target) {
      const double x = std::log(target / before->error[kind]) / std::log(r.error[kind] / before->error[kind]);
      return before->time * std::pow(r.time / before->time, x);
    }
    before = &r;
  }
  return std::nan("");
}

/* Ratios of a solver's time to the first one's over error levels */
struct Ratios {
  double logSum = 0., worst = 0., best = 0.;
  int    count = 0;

  void add(double ratio)
  {
    if (std::isnan(ratio)) return;
    logSum += std::log(ratio);
    worst = count ? std::max(worst, ratio) : ratio;
    best  = count ? std::min(best, ratio) : ratio;
    count++;
  }
  double mean() const { return count ? std::exp(logSum / count) : std::nan(""); }
};

inline const char *errorName(int kind)
{
  static const char *const names[] = {"error_q", "error_v", "error_lambda"};
  return names[kind];
}

inline void printNumber(double x)
{
  if (std::isnan(x))
    printf(" %8s", "-");
  else
    printf(" %8.3g", x);
}

inline double ratioAt(const Results &r, size_t i, size_t s, int kind, double level)
{
  return timeAtError(r.curve[i][s], kind, level) / timeAtError(r.curve[i][0], kind, level);
}

inline std::vector<double> levels(int kind)
{
  if (kind == 2) return {1e-1, 1e-2, 1e-3, 1e-4};
  return {1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6};
}

/* Per problem: one row per solver, one column per error level */
inline void printProblem(const Results &r, size_t i, int kind)
{
  printf("\n%s: CPU time / that of %s at equal %s\n%-22s", r.cases[i].name.c_str(), r.solvers[0].name.c_str(),
         errorName(kind), "");
  for (double level : levels(kind)) printf(" %8.0e", level);
  printf(" %8s %8s\n", "mean", "worst");
  for (size_t s = 0; s < r.solvers.size(); s++) {
    Ratios all;
    printf("%-22s", r.solvers[s].name.c_str());
    for (double level : levels(kind)) {
      const double x = ratioAt(r, i, s, kind, level);
      printNumber(x);
      all.add(x);
    }
    printNumber(all.mean());
    printNumber(all.count ? all.worst : std::nan(""));
    int failed = 0;
    for (const Run &run : r.curve[i][s].runs) failed += !run.failure.empty();
    if (failed) printf("  failed at %d of %d tolerances", failed, (int)r.curve[i][s].runs.size());
    printf("\n");
  }
  printf("%-22s", "time of the first, ms");
  for (double level : levels(kind)) printNumber(1e3 * timeAtError(r.curve[i][0], kind, level));
  printf("\n");
}

/* All problems: geometric means per error level and over everything */
inline void printSummary(const Results &r, int kind)
{
  printf("\nAll problems: geometric mean of CPU time / that of %s at equal %s\n%-22s", r.solvers[0].name.c_str(),
         errorName(kind), "");
  for (double level : levels(kind)) printf(" %8.0e", level);
  printf(" %8s %8s %8s %6s %8s\n", "mean", "worst", "best", "points", "failures");
  for (size_t s = 0; s < r.solvers.size(); s++) {
    Ratios all;
    int    failed = 0, runs = 0;
    printf("%-22s", r.solvers[s].name.c_str());
    for (double level : levels(kind)) {
      Ratios at;
      for (size_t i = 0; i < r.cases.size(); i++) {
        const double x = ratioAt(r, i, s, kind, level);
        at.add(x);
        all.add(x);
      }
      printNumber(at.mean());
    }
    for (size_t i = 0; i < r.cases.size(); i++)
      for (const Run &run : r.curve[i][s].runs) {
        failed += !run.failure.empty();
        runs++;
      }
    printNumber(all.mean());
    printNumber(all.count ? all.worst : std::nan(""));
    printNumber(all.count ? all.best : std::nan(""));
    printf(" %6d %4d/%d\n", all.count, failed, runs);
  }
}

/* Geometric mean per problem: where a solver is good and where not */
inline void printByProblem(const Results &r, int kind)
{
  printf("\nBy problem: geometric mean over error levels of CPU time / that of %s at equal %s\n%-22s",
         r.solvers[0].name.c_str(), errorName(kind), "");
  for (const Case &c : r.cases) printf(" %8.8s", c.name.c_str());
  printf("\n");
  for (size_t s = 0; s < r.solvers.size(); s++) {
    printf("%-22s", r.solvers[s].name.c_str());
    for (size_t i = 0; i < r.cases.size(); i++) {
      Ratios all;
      for (double level : levels(kind)) all.add(ratioAt(r, i, s, kind, level));
      printNumber(all.mean());
    }
    printf("\n");
  }
}

inline void printFailures(const Results &r)
{
  bool any = false;
  for (size_t i = 0; i < r.cases.size(); i++)
    for (size_t s = 0; s < r.solvers.size(); s++) {
      std::map<std::string, std::string> reasons; /* to the tolerances at which they occurred */
      const Curve                       &c = r.curve[i][s];
      for (size_t k = 0; k < c.runs.size(); k++) {
        if (c.runs[k].failure.empty()) continue;
        char text[32];
        snprintf(text, sizeof(text), " %.0e", c.eps[k]);
        reasons[c.runs[k].failure] += text;
      }
      for (const auto &reason : reasons) {
        if (!any) printf("\nFailures\n");
        any = true;
        printf("%-16s %-22s eps%s: %s\n", r.cases[i].name.c_str(), r.solvers[s].name.c_str(), reason.second.c_str(),
               reason.first.c_str());
      }
    }
  if (!any) printf("\nNo failures\n");
}

inline void writeRow(FILE *f, const Run &r)
{
  fprintf(f, ",%.6e,%.6e,%.6e,%.6e,%ld,%ld,%ld,%ld,%ld,%ld", r.error[0], r.error[1], r.error[2], r.time, r.count.steps,
          r.count.rejected, r.count.newton, r.count.residuals, r.count.jacobians, r.count.factorizations);
}

inline PetscErrorCode WriteCSV(const Results &r, const std::string &file)
{
  PetscFunctionBegin;
  FILE *f = fopen(file.c_str(), "w");
  PetscCheck(f, PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN, "Cannot write %s: name a directory that exists with -out",
             file.c_str());
  fprintf(f, "problem,solver,eps,error_q,error_v,error_lambda,time,steps,rejected,newton,residuals,jacobians,"
             "factorizations,failure\n");
  for (size_t i = 0; i < r.cases.size(); i++)
    for (size_t s = 0; s < r.solvers.size(); s++)
      for (size_t k = 0; k < r.curve[i][s].runs.size(); k++) {
        const Run &run = r.curve[i][s].runs[k];
        fprintf(f, "%s,\"%s\",%.3e", r.cases[i].name.c_str(), r.solvers[s].name.c_str(), r.curve[i][s].eps[k]);
        writeRow(f, run);
        fprintf(f, ",\"%s\"\n", run.failure.c_str());
      }
  fclose(f);
  PetscFunctionReturn(0);
}

/* ---- pictures ---- */

/* Range of the errors and times of what is drawn in a panel; false if there is nothing to draw */
struct Range {
  double x0 = 1e300, x1 = 0., y0 = 1e300, y1 = 0.;
};

inline bool findRange(const Results &r, size_t i, int kind, bool overview, Range &range)
{
  range = Range();
  for (size_t s = 0; s < r.solvers.size(); s++)
    for (const Run &run : r.curve[i][s].runs) {
      if ((overview && !r.solvers[s].inOverview) || !run.failure.empty() || !(run.error[kind] > 0.)) continue;
      range.x0 = std::min(range.x0, run.error[kind]);
      range.x1 = std::max(range.x1, run.error[kind]);
      range.y0 = std::min(range.y0, run.time);
      range.y1 = std::max(range.y1, run.time);
    }
  return range.x1 > 0.;
}

inline void plotData(FILE *g, const Curve &c, int kind)
{
  fprintf(g, "NaN NaN\n"); /* keeps a solver that failed everywhere in the key */
  for (const Run &r : c.runs)
    if (r.failure.empty() && r.error[kind] > 0.) fprintf(g, "%.6e %.6e\n", r.error[kind], r.time);
  fprintf(g, "e\n");
}

/* Line style of the k-th solver that is drawn */
inline std::string style(int k)
{
  static const char *const colour[] = {"#d00000", "#ff8c00", "#0060c0", "#909090", "#000000",
                                       "#8040a0", "#008060", "#a06030", "#e060a0", "#60b000"};
  static const int         point[]  = {7, 5, 9, 1, 2, 3, 4, 6, 8, 10, 12, 13};
  return std::string("with linespoints dt 1 lc rgb '") + colour[k % 10] + "' pt " + std::to_string(point[k % 12]);
}

/* Errors above 10 are no solution: the picture ends there */
inline void plotCurves(FILE *g, const Results &r, size_t i, int kind, bool overview, bool key)
{
  const char *separator = "plot ";
  int         drawn     = 0;
  Range       range;
  if (!findRange(r, i, kind, overview, range)) return;
  fprintf(g, "set xrange [%g:%g]\nset yrange [%g:%g]\n", range.x0 / 2., std::min(10., range.x1 * 2.), range.y0 / 1.5,
          range.y1 * 1.5);
  for (size_t s = 0; s < r.solvers.size(); s++) {
    if (overview && !r.solvers[s].inOverview) continue;
    fprintf(g, "%s'-' using 1:2 %s ps %g lw 1.5 ", separator, style(drawn++).c_str(), overview ? .6 : .9);
    if (key)
      fprintf(g, "title \"%s\"", r.solvers[s].title.c_str());
    else
      fprintf(g, "notitle");
    separator = ", ";
  }
  fprintf(g, "\n");
  for (size_t s = 0; s < r.solvers.size(); s++)
    if (!overview || r.solvers[s].inOverview) plotData(g, r.curve[i][s], kind);
}

inline void plotProblem(FILE *g, const Results &r, size_t i, const std::string &out)
{
  static const char *const what[] = {"positions", "velocities", "multipliers"};
  fprintf(g, "reset\nset terminal pngcairo size 1500,560 font ',10'\nset output '%s/workprecision_%s.png'\n",
          out.c_str(), r.cases[i].name.c_str());
  fprintf(g, "set multiplot layout 1,3 title '%s' font ',13'\nset logscale xy\nset format '10^{%%L}'\nset grid\n",
          r.cases[i].name.c_str());
  for (int kind = 0; kind < 3; kind++) {
    fprintf(g, "set xlabel 'error of the %s'\nset ylabel '%s'\nset key %s\n", what[kind],
            kind ? "" : "CPU time of the solve [s]", kind ? "off" : "top right font ',8' samplen 2 spacing .9");
    plotCurves(g, r, i, kind, false, kind == 0);
  }
  fprintf(g, "unset multiplot\nunset output\n");
}

/* Small multiples: a panel per problem, and the key in a strip below */
inline void plotOverview(FILE *g, const Results &r, const std::string &out)
{
  const int    panels = (int)r.cases.size(), columns = panels <= 4 ? 2 : panels <= 9 ? 3 : 4;
  const int    rows  = (panels + columns - 1) / columns;
  const double strip = .11, top = .955, height = (top - strip) / rows, width = .985 / columns;
  const char  *separator = "plot ";
  int          drawn     = 0;
  fprintf(g, "reset\nset terminal pngcairo size 1200,900 font ',10'\nset output '%s/workprecision.png'\n", out.c_str());
  fprintf(g,
          "set multiplot title 'CPU time of the solve [s] against error of the positions' font ',14'\n"
          "set logscale xy\nset format '10^{%%L}'\nset grid lc rgb '#dddddd' lt 1\nset tmargin 1.8\nset bmargin 1.8\n"
          "set lmargin 6.5\nset rmargin 1\nset xtics 100 offset 0,.3\nset ytics 10 offset .5,0\nset mytics 10\n");
  for (size_t i = 0; i < r.cases.size(); i++) {
    const int row = (int)i / columns, column = (int)i % columns;
    fprintf(g, "set origin %g,%g\nset size %g,%g\n", column * width, top - (row + 1) * height, width, height);
    fprintf(g, "set title '%s' offset 0,-.6 font ',12'\nset key off\n", r.cases[i].name.c_str());
    plotCurves(g, r, i, 0, true, false);
  }
  fprintf(g,
          "set origin 0,0\nset size 1,%g\nunset title\nunset border\nunset tics\nunset grid\nunset logscale\n"
          "set margins 1,1,0,0\nset key center center horizontal maxrows 2 samplen 3 spacing 1.4 font ',12' width 1\n"
          "set xrange [0:1]\nset yrange [0:1]\n",
          strip);
  for (const Solver &solver : r.solvers) {
    if (!solver.inOverview) continue;
    fprintf(g, "%sNaN %s lw 2 title \"%s\"", separator, style(drawn++).c_str(), solver.title.c_str());
    separator = ", ";
  }
  fprintf(g, "\nunset multiplot\nunset output\n");
}

inline PetscErrorCode Plot(const Results &r, const std::string &out)
{
  PetscFunctionBegin;
  if (system("command -v gnuplot >/dev/null 2>&1")) {
    printf("no pictures: gnuplot is not installed (Debian: gnuplot-nox)\n");
    PetscFunctionReturn(0);
  }
  FILE *g = popen("gnuplot", "w");
  PetscCheck(g, PETSC_COMM_SELF, PETSC_ERR_SYS, "gnuplot could not be started");
  for (size_t i = 0; i < r.cases.size(); i++) plotProblem(g, r, i, out);
  plotOverview(g, r, out);
  PetscCheck(pclose(g) == 0, PETSC_COMM_SELF, PETSC_ERR_LIB, "gnuplot failed");
  printf("\npictures: %s/workprecision.png, %s/workprecision_PROBLEM.png\n", out.c_str(), out.c_str());
  PetscFunctionReturn(0);
}

} // namespace wp

#endif
