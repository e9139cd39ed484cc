/* Tables of CPU time at equal error, for the terminal and for the page. */
#ifndef WORKPRECISION_TABLES_H
#define WORKPRECISION_TABLES_H

#include "page.h"
#include "workprecision_report.h"

#include <map>

namespace wp
{

using hhtbench::Text;

struct Table {
  using Row = hhtbench::Page::Row;
  std::string      caption;
  Row              head;
  std::vector<Row> rows;

  void print() const
  {
    std::vector<size_t> width(head.size(), 0);
    auto                widen = [&](const Row &row) {
      for (size_t c = 0; c < row.size() && c < width.size(); c++) width[c] = std::max(width[c], row[c].size());
    };
    widen(head);
    for (const Row &row : rows) widen(row);
    printf("\n%s\n", caption.c_str());
    printRow(head, width);
    for (const Row &row : rows) printRow(row, width);
  }
  void addTo(hhtbench::Page &page) const { page.table(head, rows, caption); }

private:
  static void printRow(const Row &row, const std::vector<size_t> &width)
  {
    for (size_t c = 0; c < row.size(); c++) printf(c ? "  %*s" : "%-*s", (int)width[c], row[c].c_str());
    printf("\n");
  }
};

inline const char *errorName(int kind)
{
  static const char *const names[] = {"error of the positions", "error of the velocities", "error of the multipliers"};
  return names[kind];
}

inline std::string Number(double x) { return std::isnan(x) ? "-" : Text("%.3g", x); }

inline int failed(const Curve &c)
{
  int n = 0;
  for (const Run &run : c.runs) n += !run.failure.empty();
  return n;
}

inline Table::Row levelHead(const char *first, int kind)
{
  Table::Row row = {first};
  for (double level : levels(kind)) row.push_back(Text("%.0e", level));
  return row;
}

/* One problem: a row for each solver, a column for each error level */
inline Table problemTable(const Results &r, size_t i, int kind)
{
  Table t;
  t.caption = r.cases[i].name + ": CPU time / that of " + r.solvers[0].name + " at equal " + errorName(kind);
  t.head    = levelHead("", kind);
  t.head.insert(t.head.end(), {"mean", "worst", "failed"});
  for (size_t s = 0; s < r.solvers.size(); s++) {
    Ratios     all;
    Table::Row row = {r.solvers[s].name};
    for (double level : levels(kind)) {
      const double x = ratioAt(r, i, s, kind, level);
      all.add(x);
      row.push_back(Number(x));
    }
    const Curve &c = r.curve[i][s];
    row.insert(row.end(),
               {Number(all.mean()), all.count ? Number(all.worst) : "-", Text("%d/%d", failed(c), (int)c.runs.size())});
    t.rows.push_back(row);
  }
  Table::Row time = {"time of the first, ms"};
  for (double level : levels(kind)) time.push_back(Number(1e3 * timeAtError(r.curve[i][0], kind, level)));
  time.resize(t.head.size());
  t.rows.push_back(time);
  return t;
}

/* Geometric means over the problems of a group, for each error level and over all of them */
inline Table summaryTable(const Results &r, const Group &group, int kind, const std::string &what,
                          Time time = Time::All)
{
  Table t;
  t.caption = what + ": geometric mean of CPU time / that of " + r.solvers[0].name + " at equal " + errorName(kind) +
              (time == Time::All ? "" : ", without the adapter's own evaluations");
  t.head = levelHead("", kind);
  t.head.insert(t.head.end(), {"mean", "worst", "best", "points", "failed"});
  for (size_t s = 0; s < r.solvers.size(); s++) {
    Ratios     all;
    int        failures = 0, runs = 0;
    Table::Row row = {r.solvers[s].name};
    for (double level : levels(kind)) {
      Ratios at;
      for (size_t i : group) {
        const double x = ratioAt(r, i, s, kind, level, time);
        at.add(x);
        all.add(x);
      }
      row.push_back(Number(at.mean()));
    }
    for (size_t i : group) {
      failures += failed(r.curve[i][s]);
      runs += (int)r.curve[i][s].runs.size();
    }
    row.insert(row.end(), {Number(all.mean()), all.count ? Number(all.worst) : "-", all.count ? Number(all.best) : "-",
                           Text("%d", all.count), Text("%d/%d", failures, runs)});
    t.rows.push_back(row);
  }
  return t;
}

/* Geometric mean for each problem, which shows where a solver is good */
inline Table byProblemTable(const Results &r, const Group &group, int kind, const std::string &what)
{
  Table t;
  t.caption = what + ", by problem: geometric mean over error levels of CPU time / that of " + r.solvers[0].name +
              " at equal " + errorName(kind);
  t.head = {"problem", "ms at 1e-3"};
  for (const Solver &solver : r.solvers) t.head.push_back(solver.name);
  for (size_t i : group) {
    Table::Row row = {r.cases[i].name, Number(1e3 * timeAtError(r.curve[i][0], kind, 1e-3))};
    for (size_t s = 0; s < r.solvers.size(); s++) {
      Ratios all;
      for (double level : levels(kind)) all.add(ratioAt(r, i, s, kind, level));
      row.push_back(Number(all.mean()));
    }
    t.rows.push_back(row);
  }
  return t;
}

/* Failures with their reasons and tolerances */
inline Table failureTable(const Results &r)
{
  Table t;
  t.caption = "Failures";
  t.head    = {"problem", "solver", "reason", "tolerances"};
  for (size_t i = 0; i < r.cases.size(); i++)
    for (size_t s = 0; s < r.curve[i].size(); s++) {
      std::map<std::string, std::string> reasons;
      const Curve                       &c = r.curve[i][s];
      for (size_t k = 0; k < c.runs.size(); k++)
        if (!c.runs[k].failure.empty()) reasons[c.runs[k].failure] += Text(" %.0e", c.eps[k]);
      for (const auto &reason : reasons)
        t.rows.push_back({r.cases[i].name, r.solvers[s].name, reason.first, reason.second.substr(1)});
    }
  if (t.rows.empty()) t.rows.push_back({"none", "", "", ""});
  return t;
}

/* Quality of the references of the scenes */
inline Table originTable(const Results &r)
{
  Table t;
  t.caption = "References of the scenes: largest differences of positions, velocities and multipliers";
  t.head    = {"scene", "by", "itself: q", "q'", "multipliers", "hhtdae: q", "q'", "multipliers", ""};
  for (size_t i = 0; i < r.cases.size(); i++) {
    if (!r.cases[i].scene) continue;
    const Origin &o   = r.origin[i];
    Table::Row    row = {(o.failure.empty() ? "" : "!") + r.cases[i].name, o.reference};
    for (double x : o.ida) row.push_back(Text("%.1e", x));
    for (double x : o.hht) row.push_back(Text("%.1e", x));
    row.push_back(o.failure);
    t.rows.push_back(row);
  }
  return t;
}

} // namespace wp

#endif
