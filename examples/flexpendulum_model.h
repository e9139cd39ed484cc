/*
  The flexible pendulum: a plate with a hole in its middle, meshed by gmsh, on a pin along y, horizontal at the start, with a block
  welded to its tip. The arm may be a modal, a rigid or a whole finite-element body.
*/
#ifndef HHTEX_FLEXPENDULUM_MODEL_H
#define HHTEX_FLEXPENDULUM_MODEL_H

#include <hhtdae/flexible.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <string>
#include <unistd.h>
#include <vector>

namespace hhtex
{

/* Dimensions in m, masses in kg */
struct HangingArm {
  double           size = 0.02, thickness = 0.005, length = 1, width = 0.05; /* size: of the mesh's elements */
  double           tip = 0.2, speed = 0;                                     /* block, rad/s at the start */
  std::string      mesh;                                                     /* file to keep the mesh in; none */
  hhtdae::Material material{7e10, 0.33, 2700};
};

/* Writes the mesh to p.mesh or, if that is empty, to a new file, which the caller has to remove */
inline PetscErrorCode MakeArmMesh(const HangingArm &p, std::string *file)
{
  PetscMPIInt rank;
  int         failed = 0, number = (int)getpid();
  char        folder[PETSC_MAX_PATH_LEN];
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCall(PetscGetTmp(PETSC_COMM_WORLD, folder, sizeof folder));
  PetscCallMPI(MPI_Bcast(&number, 1, MPI_INT, 0, PETSC_COMM_WORLD)); /* one name on all ranks */
  const std::string stem = std::string(folder) + "/flexpendulum" + std::to_string(number);
  *file                  = p.mesh.empty() ? stem + ".msh" : p.mesh;
  if (rank == 0) {
    std::ofstream geo(stem + ".geo");
    geo << "SetFactory(\"OpenCASCADE\");\n"
        << "L = " << p.length << "; w = " << p.width << "; h = " << p.thickness << "; e = 1e-6;\n"
        << "Box(1) = {0, -w/2, -h/2, L, w, h};\n"
        << "Cylinder(2) = {L/2, 0, -h, 0, 0, 2*h, w/4};\n"
        << "BooleanDifference(3) = { Volume{1}; Delete; }{ Volume{2}; Delete; };\n"
        << "Physical Volume(\"arm\") = {3};\n"
        << "Physical Surface(\"hub\") = Surface In BoundingBox{-e, -w, -h, e, w, h};\n"
        << "Physical Surface(\"tip\") = Surface In BoundingBox{L-e, -w, -h, L+e, w, h};\n"
        << "Physical Surface(\"middle\") = Surface In BoundingBox{L/2-w/4-e, -w/4-e, -h, L/2+w/4+e, w/4+e, h};\n"
        << "Mesh.MeshSizeMax = " << p.size << "; Mesh.MeshSizeFromCurvature = 16;\n"
        << "Mesh.ElementOrder = 2; Mesh.HighOrderOptimize = 1;\n";
    geo.close();
    failed = std::system(("gmsh -v 1 -3 -format msh41 -o '" + *file + "' " + stem + ".geo").c_str()) != 0;
    std::remove((stem + ".geo").c_str());
  }
  PetscCallMPI(MPI_Bcast(&failed, 1, MPI_INT, 0, PETSC_COMM_WORLD));
  PetscCheck(!failed, PETSC_COMM_WORLD, PETSC_ERR_LIB,
             "the program gmsh failed or is not installed; give a body with -body");
  PetscFunctionReturn(0);
}

inline std::vector<hhtdae::Attachment> ArmAttachments()
{
  std::vector<hhtdae::Attachment> a(3);
  a[0].name = "hub";
  a[1].name = "middle";
  a[1].tie  = hhtdae::Tie::Average;
  a[2].name = "tip";
  return a;
}

/* An arm of any kind, horizontal at the start: the bodies at its hub, middle and tip */
struct Arm {
  hhtdae::Body hub, middle, tip, modal;
};

inline hhtdae::Matrix3 AboutY() /* axes of markers: z along the pin */
{
  hhtdae::Matrix3 R;
  R << hhtdae::Vector3::UnitX(), -hhtdae::Vector3::UnitZ(), hhtdae::Vector3::UnitY();
  return R;
}

/* Adds everything except the arm. Channels: positions of tip and middle and force in the pin, x and z each; kinetic and potential energy */
inline void Hang(const HangingArm &p, const hhtdae::ModalBody &shape, const Arm &arm, hhtdae::Scene &scene)
{
  using namespace hhtdae;
  const auto    at  = [&](const char *name) { return shape.attachments[shape.attachment(name)].position; };
  const Vector3 hub = at("hub"), tip = at("tip"), w(0, -p.speed, 0);
  RigidBody     block;
  const double  half     = 0.02;
  block.mass             = p.tip;
  block.inertia          = Matrix3::Identity() * (p.tip * 2 * half * half / 3);
  block.position         = tip;
  block.velocity         = w.cross(tip - hub);
  block.angular_velocity = w;
  const Body load        = scene.add("block", block);
  scene.gravity({0, 0, -9.81});
  const Marker pin = scene.markerAt(arm.hub, hub, AboutY()), end = scene.markerAt(arm.tip, tip),
               middle = scene.markerAt(arm.middle, at("middle"));
  const Element hold  = scene.add("pin", Revolute{pin, scene.markerAt(scene.ground(), hub, AboutY())});
  scene.add("weld", Fixed{end, scene.markerAt(load, tip)});
  scene.shape(load, Shape::box(Vector3::Constant(half)));
  scene.line({pin, middle, end});
  for (int c : {0, 2}) scene.channel(c ? "tip.z" : "tip.x", Measure::displacement(end, c), "m");
  for (int c : {0, 2}) scene.channel(c ? "middle.z" : "middle.x", Measure::displacement(middle, c), "m");
  for (int c : {0, 2})
    scene.channel(c ? "pin.z" : "pin.x", Measure::jointForce(hold, c, scene.marker(scene.ground())), "N");
  scene.channel("kinetic", Measure::kineticEnergy(), "J");
  scene.channel("potential", Measure::potentialEnergy(), "J");
}

/* The arm as a modal body */
inline Arm AddModalArm(const HangingArm &p, const hhtdae::ModalBody &model, hhtdae::Scene &scene)
{
  hhtdae::FlexibleBody b;
  Arm                  arm;
  b.model            = std::make_shared<hhtdae::ModalBody>(model);
  b.angular_velocity = hhtdae::Vector3(0, -p.speed, 0);
  b.velocity         = b.angular_velocity.cross(model.center - model.attachments[model.attachment("hub")].position);
  arm.modal          = scene.add("arm", b);
  arm.hub            = scene.attachment(arm.modal, "hub");
  arm.middle         = scene.attachment(arm.modal, "middle");
  arm.tip            = scene.attachment(arm.modal, "tip");
  return arm;
}

} // namespace hhtex

#endif
