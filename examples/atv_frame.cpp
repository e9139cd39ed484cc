static char help[] =
    "Reduces the frame of the all-terrain vehicle (atv) from its mesh to 134 modes: 20 attachments, 20 normal modes.\n"
    "  gmsh -3 -o frame.msh examples/atv_frame.geo\n"
    "  mpiexec -n 2 build/bin/atv_frame -mesh frame.msh -o frame.h5\n"
    "  -mesh <frame.msh>: mesh of second-order tetrahedra, by gmsh from examples/atv_frame.geo\n"
    "  -o <frame.h5>: the reduced body, with stress modes at the corners of the elements\n"
    "  -modes <20>: fixed-interface normal modes\n";

#include "atv_frame.h"
#include <algorithm>
#include <hhtdae/flexible.h>
#include <petsctime.h>

using namespace hhtdae;

/* Own nodes within reach of an attachment's centres, by global number */
static std::vector<PetscInt> NodesOf(const FeModel &model, const hhtex::AtvAttachment &a)
{
  std::vector<PetscInt> nodes;
  for (PetscInt i = 0; i < model.own; i++) {
    const Vector3 x = Eigen::Map<const Vector3>(&model.coordinates[3 * (size_t)i]);
    for (const Vector3 &centre : a.centres)
      if ((x - centre).norm() <= a.reach) {
        nodes.push_back(model.first + i);
        break;
      }
  }
  return nodes;
}

/* Keeps the stress modes only at the corners of elements: these are a sixth of the nodes, and the largest stress occurs at one of them, on
   the surface */
static void KeepCorners(ReducedBody *body)
{
  std::vector<char> corner((size_t)body->own, 0);
  for (const FeElement &e : body->elements)
    for (int k = 0; k < 4; k++)
      if (e.node[k] >= body->first && e.node[k] < body->first + body->own)
        corner[(size_t)(e.node[k] - body->first)] = 1;
  StressModes               kept;
  std::vector<Eigen::Index> rows;
  for (size_t i = 0; i < body->stress.node.size(); i++) {
    if (!corner[(size_t)body->stress.node[i]]) continue;
    kept.node.push_back(body->stress.node[i]);
    for (int c = 0; c < 6; c++) rows.push_back(6 * (Eigen::Index)i + c);
  }
  kept.values  = body->stress.values(rows, Eigen::all);
  body->stress = std::move(kept);
}

static PetscErrorCode Run()
{
  char           mesh[PETSC_MAX_PATH_LEN] = "frame.msh", out[PETSC_MAX_PATH_LEN] = "frame.h5";
  FeModel        model(PETSC_COMM_WORLD);
  Reduction      reduction;
  ReducedBody    body;
  PetscLogDouble start, end;

  PetscFunctionBegin;
  PetscCall(PetscOptionsGetString(nullptr, nullptr, "-mesh", mesh, sizeof(mesh), nullptr));
  PetscCall(PetscOptionsGetString(nullptr, nullptr, "-o", out, sizeof(out), nullptr));
  PetscCall(PetscOptionsGetInt(nullptr, nullptr, "-modes", &reduction.modes, nullptr));
  PetscCall(PetscTime(&start));
  PetscCall(model.readMesh(mesh, {{"", Material{2.1e11, 0.3, 7850}}}));
  for (const hhtex::AtvAttachment &a : hhtex::AtvAttachments()) {
    PetscCall(model.addSet(a.name, NodesOf(model, a)));
    Attachment tie;
    tie.name     = a.name;
    tie.tie      = a.average ? Tie::Average : Tie::Rigid;
    tie.at_given = true;
    tie.position = a.point;
    reduction.attachments.push_back(tie);
  }
  reduction.progress = true;
  PetscCall(model.view(PETSC_VIEWER_STDOUT_WORLD));
  PetscCall(Reduce(model, reduction, &body));
  PetscCall(AddStressModes(model, &body));
  KeepCorners(&body);
  body.units = "m, kg, s, N";
  PetscCall(body.save(out));
  PetscCall(PetscTime(&end));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "frame: %d modes from %.1f Hz to %.0f Hz, %.1f kg, %.1f s, %s\n",
                        (int)body.modal.modes(), body.modal.omega[0] / (2 * PETSC_PI),
                        body.modal.omega[body.modal.modes() - 1] / (2 * PETSC_PI), body.modal.mass, end - start, out));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, nullptr, help));
  PetscCall(TSHHT3Initialize());
  PetscCall(Run());
  PetscCall(PetscFinalize());
  return 0;
}
