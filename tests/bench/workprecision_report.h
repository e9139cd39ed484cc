/* The results of all runs: curves of error against run time, their ratios at equal error, and the CSV of all points. */
#ifndef WORKPRECISION_REPORT_H
#define WORKPRECISION_REPORT_H

#include "workprecision_cases.h"

#include <cstdio>

namespace wp
{

/* One solver on one problem over all tolerances */
struct Curve {
  std::vector<double> eps;
  std::vector<Run>    runs;
};

struct Results {
  std::vector<Case>               cases;
  std::vector<Origin>             origin;
  std::vector<Solver>             solvers;
  std::vector<std::vector<Curve>> curve; /* [case][solver]; empty: not run */
};

/* Indices of the cases in a table or a picture */
using Group = std::vector<size_t>;

inline Group Scenes(const Results &r, bool scene)
{
  Group g;
  for (size_t i = 0; i < r.cases.size(); i++)
    if (r.cases[i].scene == scene && !r.curve[i].empty()) g.push_back(i);
  return g;
}

/* The time that counts: all of it, or all except the evaluations that only the adapter needs */
enum class Time { All, WithoutAdapter };

/* CPU time at which a curve reaches an error, interpolated log-log between the first two points that bracket it; NaN outside */
inline double timeAtError(const Curve &c, int kind, double target, Time what = Time::All)
{
  const Run *before = nullptr;
  auto       time = [&](const Run &r) { return what == Time::All ? r.time : std::max(r.time - r.extra, 0.1 * r.time); };
  for (const Run &r : c.runs) {
    if (!r.failure.empty() || !(r.error[kind] > 0.)) continue;
    if (before && before->error[kind] >= target && r.error[kind] < target) {
      const double x = std::log(target / before->error[kind]) / std::log(r.error[kind] / before->error[kind]);
      return time(*before) * std::pow(time(r) / time(*before), x);
    }
    before = &r;
  }
  return std::nan("");
}

/* Ratio of a solver's time to that of the first solver; NaN where the reference is not accurate enough */
inline double ratioAt(const Results &r, size_t i, size_t s, int kind, double level, Time what = Time::All)
{
  if (level < r.origin[i].trusted[kind]) return std::nan("");
  return timeAtError(r.curve[i][s], kind, level, what) / timeAtError(r.curve[i][0], kind, level);
}

inline std::vector<double> levels(int kind)
{
  if (kind == 2) return {1e-1, 1e-2, 1e-3, 1e-4};
  return {1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6};
}

/* Ratios of a solver's time to that of the first solver, over error levels */
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

inline void writeRow(FILE *f, const Run &r)
{
  fprintf(f, ",%.6e,%.6e,%.6e,%.6e,%.6e,%ld,%ld,%ld,%ld,%ld,%ld", r.error[0], r.error[1], r.error[2], r.time, r.extra,
          r.count.steps, r.count.rejected, r.count.newton, r.count.residuals, r.count.jacobians,
          r.count.factorizations);
}

inline PetscErrorCode WriteCSV(const Results &r, const std::string &file)
{
  PetscFunctionBegin;
  FILE *f = fopen(file.c_str(), "w");
  PetscCheck(f, PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN, "Cannot write %s: name a directory that exists with -out",
             file.c_str());
  fprintf(f, "problem,solver,eps,error_q,error_v,error_lambda,time,adapter,steps,rejected,newton,residuals,jacobians,"
             "factorizations,failure\n");
  for (size_t i = 0; i < r.cases.size(); i++)
    for (size_t s = 0; s < r.curve[i].size(); s++) /* no errors where there is no reference */
      for (size_t k = 0; k < r.curve[i][s].runs.size(); k++) {
        const Run &run = r.curve[i][s].runs[k];
        fprintf(f, "%s,\"%s\",%.3e", r.cases[i].name.c_str(), r.solvers[s].name.c_str(), r.curve[i][s].eps[k]);
        writeRow(f, run);
        fprintf(f, ",\"%s\"\n", run.failure.c_str());
      }
  fclose(f);
  PetscFunctionReturn(0);
}

} // namespace wp

#endif
