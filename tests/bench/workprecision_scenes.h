/* The scenes of the comparison: models of the example programs, over times that every integrator can complete */
#ifndef WORKPRECISION_SCENES_H
#define WORKPRECISION_SCENES_H

#include "bricard_model.h"
#include "chain_model.h"
#include "doublependulum_model.h"
#include "flexcrank_model.h"
#include "flexpendulum_model.h"
#include "flyball_model.h"
#include "heavytop_model.h"
#include "quartercar_model.h"
#include "rollingball_model.h"
#include "slidercrank3d_model.h"
#include "spinbeam_model.h"
#include "workprecision_scene.h"

namespace wp
{

using hhtdae::Scene;

/* A model that contains its scene as a member */
template <class Model, class... Args> SceneProblem::Build Modelled(Args... args)
{
  return [=](MPI_Comm comm) {
    auto model = std::make_shared<Model>(args..., comm);
    return std::shared_ptr<Scene>(model, &model->scene);
  };
}

template <class Fill> SceneProblem::Build Filled(Fill fill)
{
  return [=](MPI_Comm comm) {
    auto scene = std::make_shared<Scene>(comm);
    scene->gravity({0, -9.81, 0});
    fill(*scene);
    return scene;
  };
}

inline SceneProblem::Build QuarterCarOver(double rise)
{
  return [=](MPI_Comm comm) {
    hhtex::QuarterCarReference::Parameters p;
    p.road     = hhtdae::TimeFunction::step5(0.2, 0, 0.2 + rise, 0.05);
    auto model = std::make_shared<hhtex::QuarterCar>(p, true, comm);
    return std::shared_ptr<Scene>(model, &model->scene);
  };
}

/* The plate with a hole, meshed and reduced only once */
inline const hhtdae::ModalBody &ReducedArm()
{
  static hhtdae::ReducedBody body;
  static const bool          made = [] {
    const hhtex::HangingArm arm;
    hhtdae::FeModel         model(PETSC_COMM_SELF);
    hhtdae::Reduction       reduction;
    std::string             mesh;
    PetscCallAbort(PETSC_COMM_SELF, hhtex::MakeArmMesh(arm, &mesh));
    PetscCallAbort(PETSC_COMM_SELF, model.readMesh(mesh, {{"", arm.material}}));
    std::remove(mesh.c_str());
    reduction.attachments = hhtex::ArmAttachments();
    reduction.modes       = 4;
    PetscCallAbort(PETSC_COMM_SELF, hhtdae::Reduce(model, reduction, &body));
    return true;
  }();
  (void)made;
  return body.modal;
}

inline SceneProblem::Build FlexPendulum()
{
  return [](MPI_Comm comm) {
    auto                    scene = std::make_shared<Scene>(comm);
    const hhtex::HangingArm arm;
    hhtex::Hang(arm, ReducedArm(), hhtex::AddModalArm(arm, ReducedArm(), *scene), *scene);
    return scene;
  };
}

/* As a chain of modal bodies, or as two-node beams */
inline SceneProblem::Build SpinBeam(int parts, int beams)
{
  return [=](MPI_Comm comm) {
    auto             scene = std::make_shared<Scene>(comm);
    hhtex::SolidBeam arm   = hhtex::SpinningArm();
    hhtex::BeamEnds  ends;
    if (parts > 0) {
      hhtdae::FeModel model(PETSC_COMM_SELF);
      arm.length /= parts;
      arm.n[0] /= parts;
      PetscCallAbort(PETSC_COMM_SELF, hhtex::ReadSolidBeam(arm, &model));
      PetscCallAbort(PETSC_COMM_SELF, hhtex::AddModalBeam(*scene, model, arm.length, parts, 4, &ends));
    } else hhtex::AddBeamElements(*scene, arm, beams, &ends);
    hhtex::SpinUp(*scene, ends);
    return scene;
  };
}

#if defined(HHTDAE_HAVE_IDA)

/* Makes the problem with its reference, and reports the quality of the reference */
inline PetscErrorCode MakeScene(const std::string &name, const SceneProblem::Build &build, double end,
                                std::unique_ptr<Problem> *problem, Origin *origin)
{
  std::unique_ptr<SceneProblem> p;
  SceneReferenceSettings        s;
  SceneReferenceReport          r;

  PetscFunctionBegin;
  PetscCall(SceneProblem::make(name, build, end, &p));
  PetscCall(p->checkAxes());
  s.limits.seconds = 30.;
  PetscCall(ComputeSceneReference(*p, s, &r));
  origin->reference = r.form;
  origin->failure   = r.failure;
  for (int k = 0; k < 3; k++) {
    origin->trusted[k] = std::max(0., r.trusted(k));
    origin->ida[k]     = r.ida[k];
    origin->hht[k]     = r.hht[1][k];
  }
  *problem = std::move(p);
  PetscFunctionReturn(0);
}

inline Case makeScene(const std::string &name, double end, const SceneProblem::Build &build)
{
  Case c = SceneCallbacks();
  c.name = name;
  c.make = [=](std::unique_ptr<Problem> *p, Origin *origin) { return MakeScene(name, build, end, p, origin); };
  return c;
}

inline std::vector<Case> allScenes()
{
  using namespace hhtex;
  const double degree = PETSC_PI / 180;
  return {
      makeScene("scene:doublependulum", 2., Modelled<DoublePendulumScene>(false, false)),
      makeScene("scene:ballpendulum", 1.5, Modelled<DoublePendulumScene>(true, false)),
      makeScene("scene:slidercrank3d", 1., Modelled<SpatialSliderCrank>(6.)),
      makeScene("scene:bricard", 2., Modelled<Bricard>(0.1)),
      makeScene("scene:flyball", 1., Modelled<Flyball>(8e5, 4e4)),
      makeScene("scene:heavytop", 0.2, Modelled<FastTop>()),
      makeScene("scene:chain20", 1., Filled([](Scene &s) { AddChain(s, 20, false); })),
      makeScene("scene:net3x3", 0.5, Filled([](Scene &s) { AddNet(s, 3, 3); })),
      makeScene("scene:quartercar", 1., QuarterCarOver(0.15)),
      makeScene("scene:curb", 1., QuarterCarOver(0.04)),
      makeScene("scene:rollingball", 1., Modelled<RollingBall>(20. * degree)),
      makeScene("scene:rollingdisc", 1., Modelled<LeaningDisc>(20. * degree, 2.)),
      makeScene("scene:flexcrank", 0.02, Modelled<FlexCrank>(hhtdae::ModalMass::Full)),
      makeScene("scene:flexpendulum", 0.5, FlexPendulum()),
      makeScene("scene:spinbeam", 3., SpinBeam(2, 0)),
      makeScene("scene:spinbeams", 3., SpinBeam(0, 8)),
  };
}

#else

/* Without IDA there is no reference to compare with */
inline std::vector<Case> allScenes() { return {}; }

#endif

} // namespace wp

#endif
