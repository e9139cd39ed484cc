/* The table of stability: a line on the terminal as each case ends, a CSV file, and a page. */
#ifndef HHTDAE_BENCH_STABILITY_TABLE_H
#define HHTDAE_BENCH_STABILITY_TABLE_H

#include "page.h"
#include "stability_case.h"

#include <algorithm>
#include <fstream>

namespace hhtstab
{

class Table
{
public:
  void add(const Case &c, TSHHT3Form form, const Outcome &o)
  {
    if (rows_.empty()) printHead();
    rows_.push_back({c, form, o, c.passed(form, o)});
    print(rows_.back());
  }

  PetscErrorCode finish(const std::string &csv, const std::string &page, const std::string &conditions,
                        bool *all_passed) const
  {
    PetscFunctionBegin;
    PetscCall(writeCSV(csv));
    PetscCall(writePage(page, conditions));
    const std::size_t missed = std::count_if(rows_.begin(), rows_.end(), [](const Row &r) { return !r.passed; });
    *all_passed              = missed == 0;
    if (!conditions.empty())
      PetscCall(PetscPrintf(PETSC_COMM_SELF, "\ncond_2 of the Newton matrix: model, h, scalings (a), (b), (c)\n%s",
                            conditions.c_str()));
    PetscCall(PetscPrintf(PETSC_COMM_SELF, "\n%-12s %6s %7s  %s\n", "kind", "cases", "passed",
                          "worst figure over its acceptance"));
    for (const Summary &s : summaries())
      PetscCall(PetscPrintf(PETSC_COMM_SELF, "%-12s %6d %7d  %.2g  %s\n", s.kind.c_str(), s.cases, s.passed, s.worst,
                            s.where.c_str()));
    PetscCall(PetscPrintf(PETSC_COMM_SELF, "stability: %d of %d cases passed, %.0f s; %s, %s\n",
                          (int)(rows_.size() - missed), (int)rows_.size(), seconds(), csv.c_str(), page.c_str()));
    PetscFunctionReturn(0);
  }

private:
  struct Row {
    Case       c;
    TSHHT3Form form;
    Outcome    o;
    bool       passed;

    /* The first line of PETSc's message, or the case's own remark */
    std::string remark() const
    {
      const std::string all = o.message[0] ? o.message : o.note;
      return all.substr(0, all.find('\n'));
    }
    std::string ended() const
    {
      return o.code == -1 ? "crash" : o.code == -2 ? "deadline" : o.code ? "error" : o.finished ? "end" : "stopped";
    }
    const char *formName() const { return form == TSHHT3_FORM_PAPER ? "paper" : "2nd"; }
    double      relative() const
    {
      return std::isnan(o.figure)                      ? INFINITY
             : o.figure < 0 || c.acceptance(form) == 0 ? 0
                                                       : o.figure / c.acceptance(form);
    }
  };
  struct Summary {
    std::string kind, where;
    int         cases = 0, passed = 0;
    double      worst = 0;
  };
  std::vector<Row> rows_;

  double seconds() const
  {
    double s = 0;
    for (const Row &r : rows_) s += r.o.seconds;
    return s;
  }

  static void printHead()
  {
    std::printf("%-4s %-10s %-32s %-5s %-8s %9s %9s %8s %8s %8s %5s %5s %5s %5s %6s  %s\n", "", "kind", "case", "form",
                "outcome", "figure", "accept", "steps", "h_min", "iter", "rej", "fail", "retry", "start", "time",
                "remark");
  }
  static void print(const Row &r)
  {
    const TSHHT3Statistics &s = r.o.s;
    std::printf("%-4s %-10s %-32s %-5s %-8s %9.2e %9.2e %8d %8.1e %8d %5d %5d %5d %5d %6.2f  %.160s\n",
                r.passed ? "ok" : "MISS", r.c.kind.c_str(), r.c.name.c_str(), r.formName(), r.ended().c_str(),
                r.o.figure, r.c.acceptance(r.form), (int)s.steps, s.h_min, (int)s.newton, (int)s.rejected,
                (int)s.corrector_fails, (int)s.retries, (int)s.restarts, r.o.seconds, r.remark().c_str());
    std::fflush(stdout);
  }

  std::vector<Summary> summaries() const
  {
    std::vector<Summary> all;
    for (const Row &r : rows_) {
      auto s = std::find_if(all.begin(), all.end(), [&](const Summary &x) { return x.kind == r.c.kind; });
      if (s == all.end()) s = all.insert(all.end(), Summary{r.c.kind, ""});
      s->cases++;
      s->passed += r.passed;
      if (r.relative() < s->worst) continue;
      s->worst = r.relative();
      s->where = r.c.name + " (" + r.formName() + ")";
    }
    return all;
  }

  static std::string quoted(std::string s)
  {
    std::replace(s.begin(), s.end(), '"', '\'');
    return "\"" + s + "\"";
  }

  PetscErrorCode writeCSV(const std::string &file) const
  {
    PetscFunctionBegin;
    std::ofstream out(file);
    out << "kind,case,form,measure,accept,must_fail_with,passed,outcome,figure,t,steps,h_min,h_max,iterations,"
           "residuals,jacobians,factorizations,rejected,corrector_fails,"
           "retries,restarts,changes,tiny_steps,cpu,remark\n";
    for (const Row &r : rows_) {
      const TSHHT3Statistics &s = r.o.s;
      out << hhtbench::Text("%s,%s,%s,%s,%g,%s,%d,%s,%.6e,%.17g,%d,%.6e,%.6e,%d,%d,%d,%d,%d,%d,%d,%d,%d,%d,%.3f,%s\n",
                            r.c.kind.c_str(), quoted(r.c.name).c_str(), TSHHT3Forms[r.form],
                            quoted(r.c.measure).c_str(), r.c.acceptance(r.form), quoted(r.c.message).c_str(),
                            (int)r.passed, r.ended().c_str(), r.o.figure, r.o.t, (int)s.steps, s.h_min, s.h_max,
                            (int)s.newton, (int)s.residuals, (int)s.jacobians, (int)s.factorizations, (int)s.rejected,
                            (int)s.corrector_fails, (int)s.retries, (int)s.restarts, (int)s.changes, (int)s.tiny_steps,
                            r.o.seconds, quoted(r.remark()).c_str());
    }
    out.close();
    PetscCheck(out, PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "The table %s cannot be written", file.c_str());
    PetscFunctionReturn(0);
  }

  PetscErrorCode writePage(const std::string &file, const std::string &conditions) const
  {
    using hhtbench::Page;
    using hhtbench::Text;
    PetscFunctionBegin;
    Page                   page("Numerical stability on stiff and extreme cases");
    std::vector<Page::Row> rows;
    page.text("Every case has a figure, from an exact solution, an invariant or another formulation, and the largest "
              "value of it that is accepted. A case that cannot succeed must "
              "end in an error that says why. Steps, smallest step, corrector iterations, steps rejected by the error "
              "test, corrections that failed, of these repeated with a new "
              "matrix, consistent starts, CPU time with the reference.");
    for (const Summary &s : summaries())
      rows.push_back({(s.passed < s.cases ? "!" : "") + s.kind, Text("%d", s.cases), Text("%d", s.passed),
                      Text("%.2g", s.worst), s.where});
    page.table({"kind", "cases", "passed", "worst figure over acceptance", "where"}, rows);
    for (const Summary &s : summaries()) {
      page.section(s.kind);
      rows.clear();
      for (const Row &r : rows_)
        if (r.c.kind == s.kind) rows.push_back(pageRow(r));
      page.table({"case", "form", "outcome", "what is judged", "figure", "accept", "steps", "h min", "iterations",
                  "rejected", "failed", "retries", "starts", "s", "remark"},
                 rows);
    }
    if (!conditions.empty()) {
      page.section("Conditioning of the Newton matrix");
      page.text("cond_2 with (a) positions as unknowns, (b) accelerations, constraints unscaled, (c) constraints over "
                "beta h^2, the integrator's matrix; model, h, (a), (b), (c).");
      page.code(conditions);
    }
    PetscCall(page.write(file));
    PetscFunctionReturn(0);
  }

  static std::vector<std::string> pageRow(const Row &r)
  {
    using hhtbench::Text;
    const TSHHT3Statistics &s = r.o.s;
    return {(r.passed ? "" : "!") + r.c.name,
            r.formName(),
            r.ended(),
            r.c.measure,
            r.o.figure < 0 ? "" : Text("%.1e", r.o.figure),
            Text("%.1e", r.c.acceptance(r.form)),
            Text("%d", (int)s.steps),
            Text("%.1e", s.h_min),
            Text("%d", (int)s.newton),
            Text("%d", (int)s.rejected),
            Text("%d", (int)s.corrector_fails),
            Text("%d", (int)s.retries),
            Text("%d", (int)s.restarts),
            Text("%.2f", r.o.seconds),
            r.remark()};
  }
};

} // namespace hhtstab

#endif
