/*
  Reports options of this library that no object has read: misspelt names, with the nearest existing name, and options
  of an object whose SetFromOptions() was never called. PetscFinalize() reports them, since an object created until then
  may still read them.
*/
#include "unused.h"
#include <algorithm>
#include <string>
#include <vector>

namespace hht3
{

namespace
{

const char *const names[] = {"ts_hhtdae_",
                             "ts_hhtdae_form",
                             "ts_hhtdae_alpha",
                             "ts_hhtdae_radius",
                             "ts_hhtdae_order",
                             "ts_hhtdae_corrector_tolerance",
                             "ts_hhtdae_predictor_degree",
                             "ts_hhtdae_reuse",
                             "ts_hhtdae_start",
                             "ts_hhtdae_summary",
                             "ts_hhtdae_progress",
                             "ts_hhtdae_checkpoint",
                             "ts_hhtdae_checkpoint_every",
                             "ts_hhtdae_resume",
                             nullptr};

std::vector<const char *const *> families = {names}; /* lists of names, each ended by NULL; the first entry is the common beginning of the others */

/* Position in `option` behind the prefix of the object, at which `stem` begins; npos if the option is of another family */
size_t StemBegin(const std::string &option, const std::string &stem)
{
  size_t at = option.find(stem);
  while (at != std::string::npos && at > 0 && option[at - 1] != '_') at = option.find(stem, at + 1);
  return at;
}

/* Number of letters to insert, delete or replace in order to turn a into b */
size_t EditDistance(const std::string &a, const std::string &b)
{
  std::vector<size_t> row(b.size() + 1);
  for (size_t j = 0; j <= b.size(); j++) row[j] = j;
  for (size_t i = 0; i < a.size(); i++) {
    size_t diagonal = row[0];
    row[0]          = i + 1;
    for (size_t j = 0; j < b.size(); j++) {
      const size_t replaced = diagonal + (a[i] != b[j]);
      diagonal              = row[j + 1];
      row[j + 1]            = std::min({replaced, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row[b.size()];
}

/* The warning about an unused option; empty if the option does not belong to this library */
std::string Remark(const std::string &option)
{
  for (const char *const *family : families) {
    const size_t at = StemBegin(option, family[0]);
    if (at == std::string::npos) continue;
    const std::string prefix = option.substr(0, at), name = option.substr(at);
    const char       *nearest = nullptr;
    size_t            least   = SIZE_MAX;
    for (const char *const *n = family + 1; *n; n++) {
      const size_t d = EditDistance(name, *n);
      if (d < least) {
        least   = d;
        nearest = *n;
      }
    }
    if (least == 0) return "nobody has read it: is there an object with this options prefix, and was it set from options?";
    return "there is no such option; the nearest is -" + prefix + (nearest ? nearest : "");
  }
  return "";
}

/* unused, on rank 0: the options of this library that rank 0 has not used */
PetscErrorCode UnusedOnFirstRank(PetscMPIInt rank, std::vector<std::string> &unused)
{
  PetscInt n = 0;
  char   **name, **value;

  PetscFunctionBegin;
  if (rank) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscOptionsLeftGet(NULL, &n, &name, &value));
  for (PetscInt i = 0; i < n; i++)
    if (!Remark(name[i]).empty()) unused.push_back(name[i]);
  PetscCall(PetscOptionsLeftRestore(NULL, &n, &name, &value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* *used: an object on any rank has used the option */
PetscErrorCode UsedAnywhere(const std::string &option, PetscBool *used)
{
  char        name[256] = "";
  PetscMPIInt mine, all;

  PetscFunctionBegin;
  PetscCall(PetscStrncpy(name, option.c_str(), sizeof(name)));
  PetscCallMPI(MPI_Bcast(name, sizeof(name), MPI_CHAR, 0, PETSC_COMM_WORLD));
  PetscCall(PetscOptionsUsed(NULL, name, used));
  mine = *used;
  PetscCallMPI(MPI_Allreduce(&mine, &all, 1, MPI_INT, MPI_MAX, PETSC_COMM_WORLD));
  *used = (PetscBool)(all > 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

static bool on_all_ranks = false;

void NoteRanks(MPI_Comm comm)
{
  PetscMPIInt here, all;
  if (!MPI_Comm_size(comm, &here) && !MPI_Comm_size(PETSC_COMM_WORLD, &all)) on_all_ranks = on_all_ranks || here == all;
}

/* Collective on PETSC_COMM_WORLD. The report is therefore made only if all ranks are known to use the library, through
   a TS on all ranks or the plugin loader; otherwise it would wait forever. */
PetscErrorCode ReportUnusedOptions(void)
{
  std::vector<std::string> unused;
  PetscMPIInt              rank, n;
  PetscBool                used;

  PetscFunctionBegin;
  NoteRanks(PETSC_COMM_SELF);
  const bool report = on_all_ranks;
  on_all_ranks      = false; /* PETSc may be initialized again */
  if (!report) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCall(UnusedOnFirstRank(rank, unused));
  n = (PetscMPIInt)unused.size();
  PetscCallMPI(MPI_Bcast(&n, 1, MPI_INT, 0, PETSC_COMM_WORLD));
  unused.resize(n);
  for (const std::string &option : unused) {
    PetscCall(UsedAnywhere(option, &used));
    if (!used) PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%s: warning: option -%s was not used: %s\n", TSHHT3, option.c_str(), Remark(option).c_str()));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ForgetOptions(void)
{
  PetscFunctionBegin;
  families.resize(1);
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3

/*@C
  TSHHT3DeclareOptions - Names options, so that those among the options database that look like them but are not used are reported in
  `PetscFinalize()`

  Not Collective

  Input Parameter:
. names - ended by NULL, without the leading "-", and alive until `PetscFinalize()`; the first entry is the beginning that all
          others share, "scene_" for "scene_dt"

  Level: developer

  Notes:
  A list that has been declared before is ignored. Prefixes of objects in front of the names are allowed.

.seealso: `TSHHT3`, `TSHHT3Initialize()`, `PetscOptionsLeft()`
@*/
PetscErrorCode TSHHT3DeclareOptions(const char *const names[])
{
  PetscFunctionBegin;
  PetscAssertPointer(names, 1);
  if (std::find(hht3::families.begin(), hht3::families.end(), names) == hht3::families.end()) hht3::families.push_back(names);
  PetscFunctionReturn(PETSC_SUCCESS);
}
