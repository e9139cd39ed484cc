/* FeModel::view() and ReducedBody::view(). */
#include "flexible/exchange.h"
#include "hhtdae/flexible.h"

namespace hhtdae
{

namespace
{

/* Replaces a null viewer by that of standard output; *text: it is an ASCII viewer. Collective */
PetscErrorCode TextViewer(MPI_Comm comm, PetscViewer *viewer, PetscBool *text)
{
  PetscFunctionBegin;
  if (!*viewer) PetscCall(PetscViewerASCIIGetStdout(comm, viewer));
  PetscCall(PetscObjectTypeCompare((PetscObject)*viewer, PETSCVIEWERASCII, text));
  PetscFunctionReturn(0);
}

PetscErrorCode Sums(MPI_Comm comm, std::vector<PetscInt64> *counts)
{
  PetscFunctionBegin;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, counts->data(), (PetscMPIInt)counts->size(), MPIU_INT64, MPI_SUM, comm));
  PetscFunctionReturn(0);
}

PetscErrorCode ViewMatrix(PetscViewer viewer, const char *name, Mat A)
{
  MatInfo   info;
  PetscInt  rows;
  PetscReal norm;
  PetscFunctionBegin;
  if (!A) PetscFunctionReturn(0);
  PetscCall(MatGetSize(A, &rows, nullptr));
  PetscCall(MatGetInfo(A, MAT_GLOBAL_SUM, &info));
  PetscCall(MatNorm(A, NORM_INFINITY, &norm));
  PetscCall(PetscViewerASCIIPrintf(viewer,
                                   "  %s %" PetscInt_FMT " rows, %.0f entries, largest row sum of magnitudes %g\n",
                                   name, rows, info.nz_used, (double)norm));
  PetscFunctionReturn(0);
}

constexpr const char *element_name[] = {"tetrahedra with 4 nodes", "tetrahedra with 10 nodes", "bricks with 8 nodes",
                                        "bricks with 20 nodes"};

PetscErrorCode ViewElements(MPI_Comm comm, PetscViewer viewer, const std::vector<FeElement> &elements)
{
  std::vector<PetscInt64> count(4, 0);
  PetscFunctionBegin;
  for (const FeElement &e : elements) count[(std::size_t)e.type]++;
  PetscCall(Sums(comm, &count));
  for (std::size_t t = 0; t < 4; t++)
    if (count[t]) PetscCall(PetscViewerASCIIPrintf(viewer, "  %lld %s\n", (long long)count[t], element_name[t]));
  PetscFunctionReturn(0);
}

PetscErrorCode ViewMass(PetscViewer viewer, const ModalBody &m)
{
  const Matrix3 J = m.inertia();
  PetscFunctionBegin;
  PetscCall(PetscViewerASCIIPrintf(viewer, "  mass %.10g, centre of mass (%.10g, %.10g, %.10g)\n", m.mass, m.center[0],
                                   m.center[1], m.center[2]));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  inertia about it: xx %.8g, yy %.8g, zz %.8g, xy %.8g, yz %.8g, zx %.8g\n",
                                   J(0, 0), J(1, 1), J(2, 2), J(0, 1), J(1, 2), J(2, 0)));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  invariants quadratic in the modes: %s\n",
                                   m.quadratic[0].size() || !m.modes() ? "yes"
                                                                       : "no (mass matrix partial or constant only)"));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  geometric stiffening: %s\n", m.stiffening[0].size() ? "yes" : "no"));
  PetscFunctionReturn(0);
}

PetscErrorCode ViewModes(PetscViewer viewer, const ReducedBody &body)
{
  PetscFunctionBegin;
  PetscCall(PetscViewerASCIIPrintf(viewer, "  modes: %" PetscInt_FMT "\n", body.modal.modes()));
  if (body.modal.modes()) {
    PetscCall(PetscViewerASCIIPrintf(
        viewer, "    residual eta in the norm of the full model's stiffness: omega^2 is within eta of one of its "
                "eigenvalues, relative to\n    it; for an isolated mode the frequency is about eta^2/2 too high\n"));
    PetscCall(PetscViewerASCIIPrintf(viewer, "    mode        frequency    residual    too high\n"));
  }
  for (PetscInt k = 0; k < body.modal.modes(); k++) {
    const double turns = body.modal.omega[k] / (2 * PETSC_PI);
    const double eta   = body.mode.empty() ? -1. : body.mode[(std::size_t)k].residual;
    if (eta < 0)
      PetscCall(PetscViewerASCIIPrintf(viewer, "    %4" PetscInt_FMT " %16.9g           -           -\n", k, turns));
    else
      PetscCall(PetscViewerASCIIPrintf(viewer, "    %4" PetscInt_FMT " %16.9g %11.2e %11.2e\n", k,
                                       body.mode[(std::size_t)k].frequency, eta, eta * eta / 2));
  }
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode FeModel::view(PetscViewer viewer) const
{
  PetscBool text;
  PetscFunctionBegin;
  PetscCall(TextViewer(comm, &viewer, &text));
  if (!text) PetscFunctionReturn(0);
  PetscCall(PetscViewerASCIIPrintf(viewer, "finite-element model: %s\n", source.c_str()));
  PetscCall(
      PetscViewerASCIIPrintf(viewer, "  %" PetscInt_FMT " nodes, %" PetscInt_FMT " unknowns\n", nodes, 3 * nodes));
  PetscCall(ViewElements(comm, viewer, elements));
  for (std::size_t m = 0; m < materials.size(); m++)
    PetscCall(PetscViewerASCIIPrintf(viewer, "  material %d: Young's modulus %g, Poisson's ratio %g, density %g\n",
                                     (int)m, materials[m].young, materials[m].poisson, materials[m].density));
  PetscCall(ViewMatrix(viewer, "K", K));
  PetscCall(ViewMatrix(viewer, "M", M));
  for (const auto &set : sets) {
    std::vector<PetscInt64> count(1, (PetscInt64)set.second.size());
    PetscCall(Sums(comm, &count));
    PetscCall(PetscViewerASCIIPrintf(viewer, "  set %s: %lld nodes\n", set.first.c_str(), (long long)count[0]));
  }
  PetscCall(PetscViewerFlush(viewer));
  PetscFunctionReturn(0);
}

PetscErrorCode ReducedBody::view(PetscViewer viewer) const
{
  std::vector<PetscInt64> count{own, (PetscInt64)stress.node.size(), shape.size() > 0};
  PetscBool               text;
  PetscFunctionBegin;
  PetscCall(TextViewer(comm, &viewer, &text));
  if (!text) PetscFunctionReturn(0);
  PetscCall(Sums(comm, &count));
  PetscCall(PetscViewerASCIIPrintf(viewer, "reduced body: %s\n", modal.name.c_str()));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  source: %s, %" PetscInt_FMT " nodes; method: %s; units: %s\n",
                                   source.c_str(), fe_nodes, method.c_str(),
                                   units.empty() ? "not given" : units.c_str()));
  PetscCall(ViewMass(viewer, modal));
  for (const ModalAttachment &a : modal.attachments)
    PetscCall(PetscViewerASCIIPrintf(viewer, "  attachment %s at (%.8g, %.8g, %.8g)\n", a.name.c_str(), a.position[0],
                                     a.position[1], a.position[2]));
  if (!modal.nodes.empty()) {
    const auto turning = std::count_if(modal.nodes.begin(), modal.nodes.end(), [](const ModalNode &n) { return n.turns; });
    PetscCall(PetscViewerASCIIPrintf(viewer, "  nodes for markers: %d, from %" PetscInt_FMT " to %" PetscInt_FMT ", %d of them with rotation\n", (int)modal.nodes.size(),
                                     modal.nodes.front().label, modal.nodes.back().label, (int)turning));
  }
  for (const ModalLoadCase &l : modal.loads)
    PetscCall(PetscViewerASCIIPrintf(viewer, "  load case %s%s: force (%.8g, %.8g, %.8g), moment about the centre of mass (%.8g, %.8g, %.8g)\n", l.name.c_str(),
                                     l.modal_gradient.size() ? ", follows the surface" : "", l.force[0], l.force[1], l.force[2], l.moment[0], l.moment[1], l.moment[2]));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  kept: %lld nodes%s, %lld of them with stress modes\n",
                                   (long long)count[0], count[2] ? " with shapes" : " without shapes",
                                   (long long)count[1]));
  PetscCall(ViewElements(comm, viewer, elements));
  PetscCall(ViewModes(viewer, *this));
  PetscCall(PetscViewerFlush(viewer));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
