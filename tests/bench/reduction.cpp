/*
  Time and memory of a reduction: a frame along the edges of a box, of 8-node bricks, with attachments around it.

    mpiexec -n 2 reduction -size 80,60,40 -bar 6 -attachments 20 -modes 134

  -size: bricks along x, y, z; -bar: bricks across a bar of the frame; -average: averaging instead of rigid attachments;
  -modes: number of modes of the reduced body, and of fixed-interface modes computed: with the constraint modes there are
  more, of which the highest are left out. The program prints a line per phase: seconds, memory of all ranks after the phase
  and its maximum.
*/
#include "box_model.h"
#include "hhtdae/flexible.h"
#include <hhtdae/hhtdae.h>
#include <slepcsys.h>

using namespace hhtest;
using namespace hhtdae;

static Box Frame(const PetscInt n[3], PetscInt bar)
{
  Box box = {{(int)n[0], (int)n[1], (int)n[2]}, {0.02 * n[0], 0.02 * n[1], 0.02 * n[2]}};
  /* slightly tapered, because equal bars would have multiple frequencies, which is not the usual case */
  box.map = [](Vector3 x) {
    return Vector3(x[0], x[1] * (1 + 0.05 * x[0] - 0.02 * x[2]), x[2] * (1 + 0.08 * x[0] + 0.03 * x[1]));
  };
  box.present = [=](int i, int j, int k) {
    const int cell[3] = {i, j, k};
    int       inside  = 0; /* number of directions in which the brick is not at an edge of the box */
    for (int c = 0; c < 3; c++) inside += cell[c] >= bar && cell[c] < n[c] - bar;
    return inside <= 1;
  };
  return box;
}

/* Attachments at places along the frame's edges in x: each consists of all nodes of a piece of the bar, two bricks long */
static void AddAttachments(const Box &box, PetscInt bar, PetscInt count, Tie tie, BoxBuilder *builder,
                           Reduction *reduction)
{
  const double h = 0.02, width = h * bar;
  for (PetscInt a = 0; a < count; a++) {
    const int    edge  = a % 4;
    const double along = box.size[0] * (a / 4 + 0.5 + 0.1 * (a % 4)) / ((count + 3) / 4 + 0.3);
    const double y = edge & 1 ? box.size[1] - width : 0, z = edge & 2 ? box.size[2] - width : 0;
    const auto   name = "attachment " + std::to_string(a);
    builder->addSet(name, [=](const Vector3 &x) {
      return std::abs(x[0] - along) < 1.1 * h && x[1] > y - 1e-9 && x[1] < y + width + 1e-9 && x[2] > z - 1e-9 &&
             x[2] < z + width + 1e-9;
    });
    Attachment attachment;
    attachment.name = name;
    attachment.tie  = tie;
    reduction->attachments.push_back(attachment);
  }
}

static PetscErrorCode Run()
{
  PetscInt       n[3] = {80, 60, 40}, three = 3, bar = 6, attachments = 20, modes = 134;
  PetscBool      average = PETSC_FALSE;
  PetscLogDouble start, built, end, most;
  PetscMPIInt    size;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &size));
  PetscCall(PetscOptionsGetIntArray(nullptr, nullptr, "-size", n, &three, nullptr));
  PetscCall(PetscOptionsGetInt(nullptr, nullptr, "-bar", &bar, nullptr));
  PetscCall(PetscOptionsGetInt(nullptr, nullptr, "-attachments", &attachments, nullptr));
  PetscCall(PetscOptionsGetInt(nullptr, nullptr, "-modes", &modes, nullptr));
  PetscCall(PetscOptionsGetBool(nullptr, nullptr, "-average", &average, nullptr));
  PetscCall(PetscMemorySetGetMaximumUsage());
  PetscCall(PetscTime(&start));
  const Box  box = Frame(n, bar);
  FeModel    model(PETSC_COMM_WORLD);
  BoxBuilder builder(box, &model);
  Reduction  reduction;
  AddAttachments(box, bar, attachments, average ? Tie::Average : Tie::Rigid, &builder, &reduction);
  PetscCall(PetscTime(&built));
  PetscCall(PetscMemoryGetCurrentUsage(&most));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &most, 1, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "%d rank(s), %" PetscInt_FMT " unknowns, %" PetscInt_FMT " attachments, %" PetscInt_FMT
                        " normal modes; assembly %.1f s, %.1f MB\n",
                        size, 3 * model.nodes, attachments, modes, built - start, most / 1e6));
  reduction.modes    = modes;
  reduction.progress = true;
  for (PetscInt k = 0; k < modes; k++) reduction.keep.push_back(k);
  ReducedBody body;
  PetscCall(Reduce(model, reduction, &body));
  PetscCall(PetscTime(&end));
  double residual = 0;
  for (const ReducedMode &m : body.mode) residual = std::max(residual, m.residual);
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "in all %.1f s; %d modes kept, %.4g to %.4g Hz, residuals up to %.1e\n",
                        end - built, (int)body.modal.modes(), body.mode.front().frequency, body.mode.back().frequency,
                        residual));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  PetscCall(SlepcInitialize(&argc, &argv, nullptr, nullptr));
  PetscCall(TSHHT3Initialize());
  PetscCall(Run());
  PetscCall(SlepcFinalize());
  return 0;
}
