/* Pictures of error against run time, by gnuplot. */
#ifndef WORKPRECISION_PLOT_H
#define WORKPRECISION_PLOT_H

#include "workprecision_report.h"

#include <cstdlib>

namespace wp
{

/* Ranges of errors and times in a panel; false if there is nothing to draw */
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
  fprintf(g, "NaN NaN\n"); /* keeps a solver that failed everywhere in the legend */
  for (const Run &r : c.runs)
    if (r.failure.empty() && r.error[kind] > 0.) fprintf(g, "%.6e %.6e\n", r.error[kind], r.time);
  fprintf(g, "e\n");
}

/* Line style of the k-th solver in the picture */
inline std::string style(int k)
{
  static const char *const colour[] = {"#d00000", "#ff8c00", "#0060c0", "#909090", "#000000",
                                       "#8040a0", "#008060", "#a06030", "#e060a0", "#60b000"};
  static const int         point[]  = {7, 5, 9, 1, 2, 3, 4, 6, 8, 10, 12, 13};
  return std::string("with linespoints dt 1 lc rgb '") + colour[k % 10] + "' pt " + std::to_string(point[k % 12]);
}

/* Errors above 10 mean that there is no solution: the picture ends there */
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

inline std::string overviewName(bool scene) { return scene ? "workprecision_scenes.png" : "workprecision.png"; }

/* The name without the prefix that distinguishes a scene from the hand-written problem of the same name */
inline std::string plainName(const Case &c)
{
  const size_t colon = c.name.find(':');
  return colon == std::string::npos ? c.name : c.name.substr(colon + 1);
}

inline void plotProblem(FILE *g, const Results &r, size_t i, const std::string &out)
{
  static const char *const what[] = {"positions", "velocities", "multipliers"};
  fprintf(g, "reset\nset terminal pngcairo size 1500,560 font ',10'\nset output '%s/workprecision_%s%s.png'\n",
          out.c_str(), r.cases[i].scene ? "scene_" : "", plainName(r.cases[i]).c_str());
  fprintf(g, "set multiplot layout 1,3 title '%s' font ',13'\nset logscale xy\nset format '10^{%%L}'\nset grid\n",
          r.cases[i].name.c_str());
  for (int kind = 0; kind < 3; kind++) {
    fprintf(g, "set xlabel 'error of the %s'\nset ylabel '%s'\nset key %s\n", what[kind],
            kind ? "" : "CPU time of the solve [s]", kind ? "off" : "top right font ',8' samplen 2 spacing .9");
    plotCurves(g, r, i, kind, false, kind == 0);
  }
  fprintf(g, "unset multiplot\nunset output\n");
}

/* A panel for each problem, and the legend in a strip below */
inline void plotOverview(FILE *g, const Results &r, const Group &group, const std::string &file)
{
  const int    panels = (int)group.size(), columns = panels <= 4 ? 2 : panels <= 9 ? 3 : 4;
  const int    rows  = (panels + columns - 1) / columns;
  const double strip = .11, top = .955, height = (top - strip) / rows, width = .985 / columns;
  const char  *separator = "plot ";
  int          drawn     = 0;
  fprintf(g, "reset\nset terminal pngcairo size 1200,900 font ',10'\nset output '%s'\n", file.c_str());
  fprintf(g,
          "set multiplot title 'CPU time of the solve [s] against error of the positions' font ',14'\n"
          "set logscale xy\nset format '10^{%%L}'\nset grid lc rgb '#dddddd' lt 1\nset tmargin 1.8\nset bmargin 1.8\n"
          "set lmargin 6.5\nset rmargin 1\nset xtics 100 offset 0,.3\nset ytics 10 offset .5,0\nset mytics 10\n");
  for (int k = 0; k < panels; k++) {
    const size_t i   = group[k];
    const int    row = k / columns, column = k % columns;
    fprintf(g, "set origin %g,%g\nset size %g,%g\n", column * width, top - (row + 1) * height, width, height);
    fprintf(g, "set title '%s' offset 0,-.6 font ',12'\nset key off\n", plainName(r.cases[i]).c_str());
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

/* Pictures of every problem, and overviews of the hand-written problems and of the scenes, if there are any; drawn:
   false if gnuplot is not available */
inline PetscErrorCode Plot(const Results &r, const std::string &out, bool *drawn)
{
  PetscFunctionBegin;
  *drawn = !system("command -v gnuplot >/dev/null 2>&1");
  if (!*drawn) {
    printf("no pictures: gnuplot is not installed (Debian: gnuplot-nox)\n");
    PetscFunctionReturn(0);
  }
  FILE *g = popen("gnuplot", "w");
  PetscCheck(g, PETSC_COMM_SELF, PETSC_ERR_SYS, "gnuplot could not be started");
  for (int scene = 0; scene < 2; scene++) {
    const Group group = Scenes(r, scene);
    for (size_t i : group) plotProblem(g, r, i, out);
    if (!group.empty()) plotOverview(g, r, group, out + "/" + overviewName(scene));
  }
  PetscCheck(pclose(g) == 0, PETSC_COMM_SELF, PETSC_ERR_LIB, "gnuplot failed");
  printf("\npictures: %s/workprecision*.png\n", out.c_str());
  PetscFunctionReturn(0);
}

} // namespace wp

#endif
