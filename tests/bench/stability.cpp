static char help[] =
    "Numerical stability on stiff and extreme cases: a table of cases against outcome, in both forms of the method.\n"
    "Every case has an acceptance figure, from an exact solution, an invariant or another formulation; a case that "
    "cannot succeed must\n"
    "end in a PETSc error that says why. A case runs in a process of its own, so that a crash or a hang is a result, "
    "too.\n"
    "  -cases <a,b,...>: kinds or names of cases, or the beginnings of such\n"
    "  -form <both>: second_order, paper or both\n"
    "  -csv <stability.csv>, -page <stability.html>: the table as files\n"
    "  -show: what the library prints in a case, too; with -info every decision\n"
    "  -list: the cases, without running them\n"
    "Options of the integrator hold for all cases, -ts_hhtdae_alpha -0.1 for example. The exit code tells whether a "
    "case missed its figure.\n";

#include <hhtdae/scene.h>

#include "stability_all.h"
#include "stability_process.h"
#include "stability_table.h"

using namespace hhtstab;

static bool Chosen(const Case &c, const std::string &list)
{
  if (list.empty()) return true;
  for (std::size_t at = 0, end; at <= list.size(); at = end + 1) {
    end                     = std::min(list.find(',', at), list.size());
    const std::string begin = list.substr(at, end - at);
    if (!begin.empty() && (c.kind.rfind(begin, 0) == 0 || c.name.rfind(begin, 0) == 0)) return true;
  }
  return false;
}

static PetscErrorCode RunAll(bool *all_passed)
{
  char list[1024] = "", form[32] = "both", csv[PETSC_MAX_PATH_LEN] = "stability.csv",
       page[PETSC_MAX_PATH_LEN] = "stability.html";
  PetscBool only_list;
  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetString(nullptr, nullptr, "-cases", list, sizeof list, nullptr));
  PetscCall(PetscOptionsGetString(nullptr, nullptr, "-form", form, sizeof form, nullptr));
  PetscCall(PetscOptionsGetString(nullptr, nullptr, "-csv", csv, sizeof csv, nullptr));
  PetscCall(PetscOptionsGetString(nullptr, nullptr, "-page", page, sizeof page, nullptr));
  PetscCall(PetscOptionsHasName(nullptr, nullptr, "-list", &only_list));
  std::vector<TSHHT3Form> forms;
  for (TSHHT3Form f : {TSHHT3_FORM_SECOND_ORDER, TSHHT3_FORM_PAPER})
    if (!std::strcmp(form, "both") || !std::strcmp(form, TSHHT3Forms[f])) forms.push_back(f);
  PetscCheck(!forms.empty(), PETSC_COMM_SELF, PETSC_ERR_ARG_WRONG,
             "-form %s is neither second_order nor paper nor both", form);

  Table       table;
  ChildReport lines; /* lines that a case reports in addition to its figure */
  const Cases cases = AllCases([&lines](const std::string &model, double h, const Conditions &c) {
    lines.add(hhtbench::Text("%-20s %.0e  %9.2e  %9.2e  %9.2e", model.c_str(), h, c.a, c.b, c.c));
  });
  bool        any   = false;
  for (const Case &c : cases) {
    if (!Chosen(c, list)) continue;
    any = true;
    if (only_list) {
      PetscCall(PetscPrintf(PETSC_COMM_SELF, "%-12s %-34s %-32s %g%s%s\n", c.kind.c_str(), c.name.c_str(),
                            c.measure.c_str(), c.accept, c.message.empty() ? "" : " error: ", c.message.c_str()));
      continue;
    }
    for (TSHHT3Form f : forms) {
      Outcome out;
      PetscCall(RunApart(c, f, &out, &lines));
      table.add(c, f, out);
    }
  }
  PetscCheck(any, PETSC_COMM_SELF, PETSC_ERR_ARG_WRONG,
             "-cases %s: there is no case of this kind or name; -list shows them", list);
  if (!only_list) PetscCall(table.finish(csv, page, lines.text(), all_passed));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  bool passed = true;
  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, nullptr, help));
  PetscCall(TSHHT3Initialize());
  PetscCall(RunAll(&passed));
  PetscCall(PetscFinalize());
  return passed ? 0 : 1;
}
