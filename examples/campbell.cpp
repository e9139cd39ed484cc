static char help[] = "Campbell diagram of a disc at the end of an elastic shaft: natural frequencies against speed, beside Stodola's equation\n"
                     "  [12 EI/L^3 - m w^2, -6 EI/L^2; -6 EI/L^2, 4 EI/L - It w^2 + Ip speed w],\n"
                     "and the amplitude of the disc's whirl under an unbalance.\n"
                     "  -speeds <7>: number of speeds, from 0 to -fastest <6000> revolutions per minute\n"
                     "  -unbalance <1e-4>: kg m\n"
                     "  a picture: build/bin/campbell -speeds 61 > campbell.txt; gnuplot -p -e \"plot for [k=2:5] 'campbell.txt' using 1:k with lines\"\n"
                     "  -film PREFIX: the first mode at the highest speed, for ParaView\n";

#include "problem.h"

#include <hhtdae/helpers.h>
#include <hhtdae/linearize.h>
#include <hhtdae/scene.h>

#include <algorithm>
#include <cmath>

using namespace hhtdae;

namespace
{

constexpr double length = 0.5, radius = 0.01, disc_radius = 0.15, disc_mass = 8, E = 2.1e11, G = 8e10;

/* The shaft is fixed to a hub that can only rotate about z */
struct Rotor {
  Scene  scene{PETSC_COMM_WORLD};
  Body   disc;
  Marker centre;

  explicit Rotor(double speed)
  {
    RigidBody hub, wheel;
    hub.inertia           = inertia::cylinder(1, 0.02, 0.05);
    hub.angular_velocity  = {0, 0, speed};
    wheel.mass             = disc_mass;
    wheel.inertia          = inertia::disc(disc_mass, disc_radius);
    wheel.position         = {0, 0, length};
    wheel.angular_velocity = {0, 0, speed};
    const Body    at = scene.add("hub", hub);
    disc             = scene.add("disc", wheel);
    const Matrix3 along = axesAlong(Vector3::UnitX(), Vector3::UnitZ()); /* z axis along x, x axis along the shaft */
    const double  I = M_PI * std::pow(radius, 4) / 4;
    centre          = scene.marker(disc, {0, 0, 0}, along);
    scene.add("bearing", Revolute{scene.marker(at), scene.marker(scene.ground())});
    Beam shaft;
    shaft.i      = centre;
    shaft.j      = scene.marker(at, {0, 0, 0}, along);
    shaft.length = length;
    shaft.E      = E;
    shaft.G      = G;
    shaft.area   = M_PI * radius * radius;
    shaft.Iyy = shaft.Izz = I;
    shaft.J               = 2 * I;
    scene.add("shaft", shaft);
    scene.shape(disc, Shape::box({disc_radius, disc_radius, 0.01}));
    scene.line({shaft.j, shaft.i});
  }
};

/* Relative distance of w from the nearest root of Stodola's equation, by one Newton step on the determinant; w > 0: forward whirl, w < 0:
   backward whirl */
double FromStodola(double speed, double w)
{
  const double EI = E * M_PI * std::pow(radius, 4) / 4, L = length, It = disc_mass * disc_radius * disc_radius / 4, Ip = 2 * It;
  const double a = 12 * EI / (L * L * L) - disc_mass * w * w, b = 6 * EI / (L * L), d = 4 * EI / L - It * w * w + Ip * speed * w;
  return std::abs((a * d - b * b) / (w * (a * (Ip * speed - 2 * It * w) - 2 * disc_mass * w * d)));
}

/* Exact amplitude for the unbalance u, which is a static load in axes that rotate with the shaft */
double Whirl(double speed, double u)
{
  const double    EI = E * M_PI * std::pow(radius, 4) / 4, L = length, It = disc_mass * disc_radius * disc_radius / 4, Ip = 2 * It, square = speed * speed;
  Eigen::Matrix2d D;
  D << 12 * EI / (L * L * L) - disc_mass * square, -6 * EI / (L * L), -6 * EI / (L * L), 4 * EI / L + (Ip - It) * square;
  return std::abs(D.inverse()(0, 0) * u * square);
}

/* A rotating force is the sum of a harmonic force along x and one along y a quarter of a period later */
PetscErrorCode Unbalanced(const Rotor &r, const Linearization &small, double speed, double u, double *amplitude)
{
  std::vector<std::complex<double>> x, y;
  const Measure                     out = Measure::displacement(r.centre, 0);
  PetscFunctionBegin;
  PetscCall(small.response(Excitation::force(r.centre, {1, 0, 0}), out, {speed}, &x));
  PetscCall(small.response(Excitation::force(r.centre, {0, 1, 0}), out, {speed}, &y));
  *amplitude = u * speed * speed * std::abs(x[0] - std::complex<double>(0, 1) * y[0]);
  PetscFunctionReturn(0);
}

PetscErrorCode At(double speed, double u, const char film[], double worst[2])
{
  Rotor               r(speed);
  TS                  ts;
  Linearization       small;
  std::vector<Mode>   modes;
  std::vector<double> found;
  double              whirl = 0;
  PetscFunctionBegin;
  PetscCall(r.scene.createTS(&ts));
  PetscCall(small.take(ts));
  PetscCall(small.modes(&modes));
  std::sort(modes.begin(), modes.end(), [](const Mode &a, const Mode &b) { return a.value.imag() < b.value.imag(); });
  for (const Mode &m : modes) {
    BodyPart disc;
    PetscCall(small.part(m, r.disc, &disc));
    const double bending = disc.displacement.head<2>().norm() + disc.rotation.head<2>().norm();
    if (m.value.imag() > 1 && bending > 1e-6) found.push_back(m.value.imag()); /* leaves out axial and torsional modes */
  }
  PetscCheck(found.size() == 4, PETSC_COMM_WORLD, PETSC_ERR_PLIB, "%d modes of bending at %g rad/s", (int)found.size(), speed);
  if (speed > 0) PetscCall(Unbalanced(r, small, speed, u, &whirl));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%9.0f", 30 * speed / M_PI));
  for (std::size_t k = 0; k < found.size(); k++) {
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "  %10.4f", found[k] / (2 * M_PI)));
    worst[0] = std::max(worst[0], std::min(FromStodola(speed, found[k]), FromStodola(speed, -found[k])));
  }
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "  %12.4e\n", whirl));
  if (speed > 0) worst[1] = std::max(worst[1], std::abs(whirl / Whirl(speed, u) - 1));
  for (const Mode &m : modes)
    if (film[0] && m.value.imag() == found[0]) PetscCall(small.animate(m, film, 0.05));
  PetscCall(TSDestroy(&ts));
  PetscFunctionReturn(0);
}

PetscErrorCode Run()
{
  PetscInt  speeds  = 7;
  PetscReal fastest = 6000, unbalance = 1e-4;
  char      film[PETSC_MAX_PATH_LEN] = "";
  double    worst[2]                 = {0, 0};
  PetscFunctionBegin;
  PetscCall(PetscOptionsGetInt(nullptr, nullptr, "-speeds", &speeds, nullptr));
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-fastest", &fastest, nullptr));
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-unbalance", &unbalance, nullptr));
  PetscCall(PetscOptionsGetString(nullptr, nullptr, "-film", film, sizeof film, nullptr));
  PetscCheck(speeds > 1 && fastest > 0, PETSC_COMM_WORLD, PETSC_ERR_ARG_OUTOFRANGE, "-speeds %d must be 2 or more, -fastest %g positive", (int)speeds, (double)fastest);
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "#   1/min  frequencies of bending, Hz                      unbalance, m\n"));
  for (PetscInt k = 0; k < speeds; k++) PetscCall(At(fastest * M_PI / 30 * (double)k / (double)(speeds - 1), unbalance, k + 1 < speeds ? "" : film, worst));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "# largest relative difference from Stodola's equation: %.1e, under the unbalance %.1e\n", worst[0], worst[1]));
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
