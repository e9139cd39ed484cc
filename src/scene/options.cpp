/* Reads the options of the start, and reports its results. */
#include "start.h"

namespace hhtdae
{

PetscErrorCode ReadStartOptions(SceneData &s)
{
  static const char *const assemblies[] = {"off", "report", "project"}, *const redundants[] = {"drop", "refuse",
                                                                                               "keep"},
                    *const rotations[] = {"local", "euler313"};
  StartPolicy &p        = s.start;
  PetscInt     assembly = (PetscInt)p.assembly, redundant = (PetscInt)p.redundant, rotation = (PetscInt)p.rotations;
  PetscReal    tolerance = p.tolerance, time = p.time, angle_tol = p.angle_tol;
  PetscBool    equilibrium = (PetscBool)p.equilibrium, view = (PetscBool)p.view;
  PetscFunctionBegin;
  PetscOptionsBegin(s.comm, nullptr, "Start of a multibody scene", "Scene");
  PetscCall(PetscOptionsEList("-scene_assemble", "Initial values that violate the constraints", "StartPolicy::assembly",
                              assemblies, 3, assemblies[assembly], &assembly, nullptr));
  PetscCall(PetscOptionsReal("-scene_assemble_tol", "Accepted violation of constraints, relative to the size of the largest mechanism",
                             "StartPolicy::tolerance", tolerance, &tolerance, nullptr));
  PetscCall(PetscOptionsEList("-scene_redundant", "Redundant constraints", "StartPolicy::redundant", redundants, 3,
                              redundants[redundant], &redundant, nullptr));
  PetscCall(PetscOptionsBool("-scene_equilibrium", "Start in static equilibrium", "StartPolicy::equilibrium",
                             equilibrium, &equilibrium, nullptr));
  PetscCall(
      PetscOptionsBool("-scene_view", "Print what the start has done", "StartPolicy::view", view, &view, nullptr));
  PetscCall(
      PetscOptionsReal("-scene_start_time", "Time of the initial values", "StartPolicy::time", time, &time, nullptr));
  PetscCall(PetscOptionsEList("-scene_rotations", "Coordinates of rotations in space", "StartPolicy::rotations", rotations,
                              2, rotations[rotation], &rotation, nullptr));
  PetscCall(PetscOptionsReal("-scene_angle_tol", "Tolerance of the rotations of bodies, radians; 0: -ts_atol", "StartPolicy::angle_tol",
                             angle_tol, &angle_tol, nullptr));
  PetscOptionsEnd();
  PetscCheck(tolerance > 0, s.comm, PETSC_ERR_ARG_OUTOFRANGE, "-scene_assemble_tol is %g, must be positive",
             (double)tolerance);
  PetscCheck(angle_tol >= 0, s.comm, PETSC_ERR_ARG_OUTOFRANGE, "-scene_angle_tol is %g, must be positive, or 0 for the tolerance -ts_atol", (double)angle_tol);
  p.assembly    = (Assembly)assembly;
  p.redundant   = (Redundant)redundant;
  p.tolerance   = tolerance;
  p.equilibrium = equilibrium;
  p.view        = view;
  p.time        = time;
  p.rotations   = (Rotations)rotation;
  p.angle_tol   = angle_tol;
  PetscFunctionReturn(0);
}

/* Views the contents of the scene and the results of the start */
PetscErrorCode ViewStart(const SceneData &s, PetscViewer viewer)
{
  const StartResult              &r = s.started;
  std::map<std::string, PetscInt> types;
  PetscFunctionBegin;
  for (const ElementData &e : s.elements) types[e.type]++;
  PetscCall(PetscViewerASCIIPrintf(viewer, "scene: %d bodies, %d joints and forces\n", (int)s.bodies.size(),
                                   (int)s.elements.size()));
  for (const auto &t : types) PetscCall(PetscViewerASCIIPrintf(viewer, "  %s: %d\n", t.first.c_str(), (int)t.second));
  PetscCall(PetscViewerASCIIPrintf(
      viewer, "  %d coordinates, %d constraints, of these %d redundant and %d dropped: %d degrees of freedom\n",
      (int)r.coordinates, (int)r.rows, (int)r.redundant, (int)r.dropped.size(), (int)r.degreesOfFreedom()));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
