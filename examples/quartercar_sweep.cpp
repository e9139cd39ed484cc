static char help[] = "Quarter car over a curb, run after run with another damper and another spring: which suspension is comfortable, and "
                     "keeps the tire on the road?\n"
                     "The scene is described once; quantities that change from run to run are parameters.\n"
                     "  -runs <12>: dampers to try, from 500 to 4000 N s/m, each with three springs\n"
                     "  -end <1>: end time, s\n";

#include "problem.h"

#include <hhtdae/query.h>
#include <hhtdae/scene.h>

#include <algorithm>
#include <cmath>
#include <ctime>

using namespace hhtdae;

namespace
{

struct QuarterCar {
  Scene   scene{PETSC_COMM_WORLD};
  Marker  seat;
  Element tire;

  QuarterCar()
  {
    const Parameter stiffness = scene.parameter("stiffness", 2e4), damping = scene.parameter("damping", 1500);
    const double    body = 300, wheel = 40, g = 9.81, radius = 0.3, tire_stiffness = 1.8e5;
    const double    hub = radius - (body + wheel) * g / tire_stiffness;
    scene.gravity({0, 0, -g});
    RigidBody w, b, road;
    w.mass        = wheel;
    w.position    = {0, 0, hub};
    b.mass        = body;
    b.position    = {0, 0, hub + 0.4};
    const Body   R = scene.add("road", road), W = scene.add("wheel", w), B = scene.add("body", b);
    const Marker datum = scene.marker(scene.ground()), surface = scene.marker(R), axle = scene.marker(W);
    seat = scene.marker(B);
    scene.add("road's guide", Translational{surface, datum});
    scene.add("wheel's guide", Translational{axle, datum});
    scene.add("body's guide", Translational{seat, datum});
    scene.add("road's motion", TranslationalMotion{surface, datum, TimeFunction::step5(0.1, 0, 0.14, 0.05)});
    scene.add("suspension", [=, top = seat] { return SpringDamper{top, axle, stiffness, damping, 0.4, -body * g}; });
    ContactLaw law;
    law.stiffness = tire_stiffness;
    law.damping   = 100;
    tire          = scene.add("tire", SpherePlane{axle, surface, radius, law});
    scene.channel("acceleration", Measure::acceleration(seat, 2), "m/s^2");
    scene.channel("tire", Measure::force(tire, 2), "N");
  }
};

/* Mean square of the body's acceleration, and the time during which the tire does not touch the road */
struct Verdict {
  double square = 0, air = 0, last = 0;
};

PetscErrorCode Look(TS ts, PetscInt step, PetscReal t, Vec, void *ctx)
{
  auto               &[car, verdict] = *static_cast<std::pair<QuarterCar *, Verdict> *>(ctx);
  std::vector<double> x;
  PetscFunctionBegin;
  if (step <= 0) PetscFunctionReturn(0);
  PetscCall(car->scene.sample(ts, t, x));
  verdict.square += x[0] * x[0] * (t - verdict.last);
  if (x[1] == 0) verdict.air += t - verdict.last;
  verdict.last = t;
  PetscFunctionReturn(0);
}

PetscErrorCode Run()
{
  PetscInt       runs = 12;
  PetscReal      end  = 1;
  double    solving = 0;
  PetscFunctionBegin;
  PetscCall(PetscOptionsGetInt(nullptr, nullptr, "-runs", &runs, nullptr));
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-end", &end, nullptr));
  PetscCheck(runs > 0 && end > 0, PETSC_COMM_WORLD, PETSC_ERR_ARG_OUTOFRANGE, "-runs %d and -end %g must be positive", (int)runs, (double)end);
  const double begun = (double)std::clock();
  QuarterCar car;
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "stiffness N/m  damping N s/m  body rms m/s^2  tire in the air s\n"));
  for (double k : {1e4, 2e4, 4e4})
    for (PetscInt i = 0; i < runs; i++) {
      const double                      c = 500 + 3500. * (double)i / (double)std::max<PetscInt>(runs - 1, 1);
      std::pair<QuarterCar *, Verdict>  look{&car, {}};
      TS                                ts;
      PetscCall(car.scene.set("stiffness", k));
      PetscCall(car.scene.set("damping", c));
      PetscCall(car.scene.createTS(&ts));
      PetscCall(TSSetMaxTime(ts, end));
      PetscCall(TSSetTolerances(ts, 1e-5, nullptr, 1e-5, nullptr));
      PetscCall(TSSetFromOptions(ts));
      PetscCall(TSMonitorSet(ts, Look, &look, nullptr));
      const double from = (double)std::clock();
      PetscCall(car.scene.solve(ts));
      solving += (double)std::clock() - from;
      if (runs <= 20 || i % (runs / 10) == 0)
        PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%13.0f  %13.0f  %14.3f  %17.4f\n", k, c, std::sqrt(look.second.square / end), look.second.air));
      PetscCall(TSDestroy(&ts));
    }
  const double all = (double)std::clock() - begun;
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%d runs: %.3f s of processor time, %.2f times that of their steps\n", (int)(3 * runs), all / CLOCKS_PER_SEC, all / solving));
  PetscFunctionReturn(0);
}

} // namespace

int main(int argc, char **argv)
{
  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, nullptr, help));
  PetscCall(TSHHT3Initialize());
  PetscCall(Run());
  PetscCall(PetscFinalize());
  return 0;
}
