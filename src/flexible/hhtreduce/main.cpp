/* hhtreduce: reduces finite-element models to files of flexible bodies, and shows such files; see hhtreduce -help. */
#include "options.h"
#include <cmath>
#include <slepcsys.h>
#include <sys/stat.h>
#include <unistd.h>

using namespace hhtdae;
using namespace hhtreduce;

namespace
{

/* Error handler data: PETSc's first message, printed in place of its traceback */
struct Failure {
  std::string message;
};

PetscErrorCode KeepFirstMessage(MPI_Comm, int line, const char *function, const char *file, PetscErrorCode code,
                                PetscErrorType type, const char *message, void *ctx)
{
  Failure *failure = static_cast<Failure *>(ctx);
  if (type != PETSC_ERROR_INITIAL || !failure->message.empty()) return code;
  failure->message = message && *message ? message
                                         : "error " + std::to_string((int)code) + " in " + (function ? function : "?") +
                                               ", " + (file ? file : "?") + ":" + std::to_string(line);
  return code;
}

/* Whether all ranks arrive here within five seconds: a rank that failed alone must not leave the others waiting */
bool AllArrive()
{
  MPI_Request request;
  int         done = 0;
  if (MPI_Ibarrier(PETSC_COMM_WORLD, &request)) return false;
  for (int tenths = 0; tenths < 50 && !done; tenths++) {
    MPI_Test(&request, &done, MPI_STATUS_IGNORE);
    if (!done) usleep(100000);
  }
  return done;
}

/* Prints the message once, and ends all ranks */
void Report(PetscErrorCode code, const std::string &message)
{
  PetscMPIInt rank, size, mine, first;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  MPI_Comm_size(PETSC_COMM_WORLD, &size);
  const bool together = AllArrive();
  mine                = message.empty() ? size : rank;
  if (together)
    MPI_Allreduce(&mine, &first, 1, MPI_INT, MPI_MIN, PETSC_COMM_WORLD);
  else
    first = rank;
  if (rank == first) fprintf(stderr, "hhtreduce: error: %s\n", message.c_str());
  if (!together) MPI_Abort(PETSC_COMM_WORLD, (int)code);
}

PetscErrorCode ReadTheModel(const Task &task, FeModel *model)
{
  PetscFunctionBegin;
  if (!task.mesh.empty())
    PetscCall(model->readMesh(task.mesh, task.materials));
  else if (!task.calculix.empty())
    PetscCall(model->readCalculix(task.calculix));
  else
    PetscCall(model->readMatrices(task.stiffness, task.mass, task.nodes, task.sets));
  PetscFunctionReturn(0);
}

/* Checks before the reduction that the output can be written */
PetscErrorCode CheckOutput(const std::string &file)
{
  PetscMPIInt rank;
  int         good = 1;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  const std::string folder = file.rfind('/') == std::string::npos ? "." : file.substr(0, file.rfind('/') + 1);
  if (!rank) good = access(folder.c_str(), W_OK) == 0;
  PetscCallMPI(MPI_Bcast(&good, 1, MPI_INT, 0, PETSC_COMM_WORLD));
  PetscCheck(good, PETSC_COMM_WORLD, PETSC_ERR_FILE_OPEN,
             "%s cannot be written: folder %s is missing, or there is no right to write there", file.c_str(),
             folder.c_str());
  PetscFunctionReturn(0);
}

PetscErrorCode RunReduction(const Task &task)
{
  FeModel        model(PETSC_COMM_WORLD);
  ReducedBody    body;
  PetscLogDouble start, read, reduced, written;
  struct stat    status;
  PetscFunctionBegin;
  PetscCall(CheckOutput(task.output));
  PetscCall(PetscTime(&start));
  PetscCall(ReadTheModel(task, &model));
  PetscCall(PetscTime(&read));
  if (!task.quiet) PetscCall(model.view(nullptr));
  if (!task.quiet) PetscCall(PetscPrintf(PETSC_COMM_WORLD, "read in %.2f s\n", read - start));
  PetscCall(Reduce(model, task.reduction, &body));
  if (task.stress) PetscCall(AddStressModes(model, &body));
  PetscCall(PetscTime(&reduced));
  body.modal.name = task.name;
  body.units      = task.units;
  if (!task.reduction.all_nodes) body.elements.clear();
  PetscCall(body.save(task.output));
  PetscCall(PetscTime(&written));
  if (task.quiet) PetscFunctionReturn(0);
  PetscCall(body.view(nullptr));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "reduced in %.2f s, written in %.2f s: %s, %.1f MB\n", reduced - read,
                        written - reduced, task.output.c_str(),
                        stat(task.output.c_str(), &status) ? 0.0 : 1e-6 * (double)status.st_size));
  PetscFunctionReturn(0);
}

PetscErrorCode ShowInfo(const Task &task)
{
  ReducedBody body;
  PetscFunctionBegin;
  PetscCall(body.load(PETSC_COMM_WORLD, task.body));
  PetscCall(body.view(nullptr));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "  checksum: good\n"));
  PetscFunctionReturn(0);
}

/* The modal coordinate for which the largest displacement is a twentieth of the body's size */
PetscErrorCode VisibleScale(const ReducedBody &body, PetscInt mode, double *scale)
{
  double largest = 0, bounds[6] = {-1e300, -1e300, -1e300, -1e300, -1e300, -1e300};
  PetscFunctionBegin;
  for (PetscInt i = 0; i < body.own; i++) {
    if (body.shape.size()) largest = std::max(largest, body.shape.block<3, 1>(3 * i, mode).norm());
    for (int c = 0; c < 3; c++) {
      bounds[c]     = std::max(bounds[c], body.coordinates[3 * (std::size_t)i + (std::size_t)c]);
      bounds[c + 3] = std::max(bounds[c + 3], -body.coordinates[3 * (std::size_t)i + (std::size_t)c]);
    }
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPI_DOUBLE, MPI_MAX, body.comm));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, bounds, 6, MPI_DOUBLE, MPI_MAX, body.comm));
  const double size = std::hypot(bounds[0] + bounds[3], bounds[1] + bounds[4], bounds[2] + bounds[5]);
  *scale            = largest > 0 ? size / 20 / largest : 1;
  PetscFunctionReturn(0);
}

PetscErrorCode WritePicture(const Task &task)
{
  ReducedBody body;
  double      scale = task.scale;
  PetscFunctionBegin;
  PetscCall(body.load(PETSC_COMM_WORLD, task.body));
  PetscCheck(task.mode < body.modal.modes(), PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "-mode %" PetscInt_FMT ": %s has modes 0 .. %" PetscInt_FMT, task.mode, task.body.c_str(),
             body.modal.modes() - 1);
  if (!task.scale_given) PetscCall(VisibleScale(body, task.mode, &scale));
  Eigen::VectorXd eta = Eigen::VectorXd::Zero(body.modal.modes());
  eta[task.mode]      = scale;
  PetscCall(WriteField(body, eta, task.vtu));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%s: mode %" PetscInt_FMT " of %s, frequency %.9g, modal coordinate %g\n",
                        task.vtu.c_str(), task.mode, task.body.c_str(), body.modal.omega[task.mode] / (2 * PETSC_PI),
                        scale));
  PetscFunctionReturn(0);
}

PetscErrorCode Run(const Arguments &arguments)
{
  Task task;
  PetscFunctionBegin;
  if (arguments.help_alone) {
    PetscCall(PetscFPrintf(PETSC_COMM_WORLD, stdout, "%s", help));
    PetscFunctionReturn(0);
  }
  PetscCall(ReadTask(arguments, &task));
  if (task.kind == Task::ReduceModel) PetscCall(RunReduction(task));
  if (task.kind == Task::Info) PetscCall(ShowInfo(task));
  if (task.kind == Task::Picture) PetscCall(WritePicture(task));
  PetscCall(WarnOfUnused());
  PetscFunctionReturn(0);
}

} // namespace

int main(int argc, char **argv)
{
  Arguments           arguments(argc, argv);
  std::vector<char *> words;
  Failure             failure;
  bool                trace = false;
  for (std::string &word : arguments.words) {
    words.push_back(&word[0]);
    trace = trace || word == "-traceback";
  }
  words.push_back(nullptr);
  int    count = (int)words.size() - 1;
  char **list  = words.data();
  if (SlepcInitialize(&count, &list, nullptr, help)) return 2;
  if (!trace) PetscPushErrorHandler(KeepFirstMessage, &failure);
  const PetscErrorCode code = Run(arguments);
  if (!trace) PetscPopErrorHandler();
  if (code) Report(code, failure.message);
  if (SlepcFinalize()) return 2;
  return code ? 1 : 0;
}
