static char help[] =
    "Pendulum with a flexible arm: a plate with a hole, meshed by gmsh, reduced, saved, loaded, swinging; stress out.\n"
    "The arm is 1 m long, of aluminium; a block is welded to its tip; it is let go where it is horizontal.\n"
    "  -modes <4>[,<12>,...]: normal modes of the reduction; a run for each number, the last one with stress\n"
    "  -size <0.02> -thickness <0.005>: of the mesh's elements, of the plate, m\n"
    "  -tip <0.2>: mass of the block, kg;  -speed <0>: of the arm at the start, rad/s\n"
    "  -end <1> -samples <500>: end time, s; number of times at which results are recorded\n"
    "  -o <file.h5>: keeps the reduced body;  -save_mesh <file.msh>: the mesh, for hhtreduce\n"
    "  -body <file.h5>: takes the body of such a file, by this program or by\n"
    "      hhtreduce -mesh arm.msh -material 7e10,0.33,2700\n"
    "        -attach hub:hub,middle:middle:average,tip:tip -modes 4 -stress -o arm.h5\n"
    "  -full: runs the whole finite-element model too, geometrically nonlinear, and compares\n"
    "  -spots <5>: places of largest stress;  -stress <file.vtu>: the field of stress when it is largest\n"
    "  -plot <file.png>: deflection of the middle and force in the pin, by gnuplot\n"
    "  -scene_animation <prefix>: pictures for ParaView\n";

#include "flexpendulum_model.h"
#include "problem.h"
#include "scene_watch.h"

#include <hhtdae/flexible.h>

#include <algorithm>
#include <cstdlib>
#include <slepcsys.h>
#include <unistd.h>

using namespace hhtdae;
using hhtex::Arm;

struct Pendulum : hhtex::HangingArm {
  double                end     = 1;
  PetscInt              samples = 500, spots = 5;
  std::string           body, out, field, plot;
  bool                  full  = false;
  std::vector<PetscInt> modes = {4};
};

/* Indices of the values that are recorded at equal time intervals */
enum { TipX, TipZ, MiddleX, MiddleZ, PinX, PinZ, Kinetic, Potential, Modal };
struct History {
  std::string                      name;
  std::vector<double>              time;
  std::vector<std::vector<double>> x;
  double                           seconds = 0;

  /* distance of the middle from the line between pin and tip */
  double deflection(std::size_t k, const Vector3 &hub, double share) const
  {
    const double dx = x[k][TipX] - hub(0), dz = x[k][TipZ] - hub(2), mx = x[k][MiddleX] - hub(0) - share * dx,
                 mz = x[k][MiddleZ] - hub(2) - share * dz;
    return (dx * mz - dz * mx) / std::hypot(dx, dz);
  }
};

/* ---- the reduced body, through its file ---- */

static PetscErrorCode MakeBody(const Pendulum &p, const FeModel &model, PetscInt modes, ReducedBody *body)
{
  Reduction   reduction;
  ReducedBody made;
  int         number = (int)getpid();
  PetscMPIInt rank;
  char        folder[PETSC_MAX_PATH_LEN];
  PetscFunctionBeginUser;
  reduction.attachments = hhtex::ArmAttachments();
  reduction.modes       = modes;
  reduction.progress    = true;
  PetscCall(Reduce(model, reduction, &made));
  PetscCall(AddStressModes(model, &made));
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCall(PetscGetTmp(PETSC_COMM_WORLD, folder, sizeof folder));
  PetscCallMPI(MPI_Bcast(&number, 1, MPI_INT, 0, PETSC_COMM_WORLD));
  const std::string file =
      p.out.empty() ? std::string(folder) + "/flexpendulum" + std::to_string(number) + ".h5" : p.out;
  PetscCall(made.save(file));
  PetscCall(body->load(PETSC_COMM_WORLD, file));
  if (p.out.empty() && rank == 0) std::remove(file.c_str());
  PetscFunctionReturn(0);
}

/* ---- the scene ---- */

static PetscErrorCode Swing(const Pendulum &p, Scene &scene, HotSpots *hot, History *h)
{
  TS               ts;
  PetscErrorCode   failed = 0;
  TSHHT3Statistics s;
  PetscFunctionBeginUser;
  PetscCall(scene.createTS(&ts));
  PetscCall(TSSetMaxTime(ts, p.end));
  PetscCall(TSSetMaxSteps(ts, 10000000));
  PetscCall(TSSetTolerances(ts, 1e-6, nullptr, 1e-6, nullptr));
  PetscCall(TSSetFromOptions(ts));
  hhtex::Watch watch(scene, p.end / (double)p.samples, [&](double t, const std::vector<double> &x) {
    h->time.push_back(t);
    h->x.push_back(x);
    if (hot && !failed)
      failed = hot->add(t, Eigen::Map<const Eigen::VectorXd>(x.data() + Modal, (Eigen::Index)x.size() - Modal));
  });
  PetscCall(watch.attach(ts));
  PetscCall(scene.solve(ts));
  PetscCall(failed);
  PetscCall(TSHHT3GetStatistics(ts, &s));
  h->seconds = s.time;
  PetscCall(TSDestroy(&ts));
  PetscFunctionReturn(0);
}

static PetscErrorCode SwingModal(const Pendulum &p, const ReducedBody &body, HotSpots *hot, History *h)
{
  Scene scene(PETSC_COMM_WORLD);
  PetscFunctionBeginUser;
  const Arm arm = hhtex::AddModalArm(p, body.modal, scene);
  hhtex::Hang(p, body.modal, arm, scene);
  for (PetscInt k = 0; k < body.modal.modes(); k++)
    scene.channel("eta" + std::to_string(k + 1), Measure::modal(arm.modal, (int)k));
  PetscCall(Swing(p, scene, hot, h));
  PetscFunctionReturn(0);
}

static PetscErrorCode SwingRigid(const Pendulum &p, const ModalBody &body, History *h)
{
  Scene     scene(PETSC_COMM_WORLD);
  RigidBody b;
  Arm       arm;
  PetscFunctionBeginUser;
  h->name            = "rigid";
  b.mass             = body.mass;
  b.inertia          = body.inertia();
  b.center           = body.center;
  b.angular_velocity = Vector3(0, -p.speed, 0);
  b.velocity         = b.angular_velocity.cross(body.center - body.attachments[body.attachment("hub")].position);
  arm.hub = arm.middle = arm.tip = scene.add("arm", b);
  hhtex::Hang(p, body, arm, scene);
  PetscCall(Swing(p, scene, nullptr, h));
  PetscFunctionReturn(0);
}

static PetscErrorCode SwingFull(const Pendulum &p, const FeModel &model, const ModalBody &shape, History *h)
{
  Scene      scene(PETSC_COMM_WORLD);
  FullFeBody fe;
  FullBody   b;
  Arm        arm;
  PetscFunctionBeginUser;
  h->name            = "full";
  b.attachments      = hhtex::ArmAttachments();
  b.angular_velocity = Vector3(0, -p.speed, 0);
  b.velocity         = b.angular_velocity.cross(-shape.attachments[shape.attachment("hub")].position);
  PetscCall(fe.add(scene, "arm", model, b));
  arm.hub    = fe.attachment("hub");
  arm.middle = fe.attachment("middle");
  arm.tip    = fe.attachment("tip");
  hhtex::Hang(p, shape, arm, scene);
  PetscCall(Swing(p, scene, nullptr, h));
  PetscFunctionReturn(0);
}

/* ---- results ---- */

/* Undeformed position of the hub, and place of the middle along the arm, which several results need */
struct Line {
  Vector3 hub;
  double  share; /* place of the middle along the arm */
  explicit Line(const ModalBody &b)
  {
    const auto at = [&](const char *name) { return b.attachments[b.attachment(name)].position; };
    hub           = at("hub");
    share         = (at("middle") - hub).norm() / (at("tip") - hub).norm();
  }
};

static double EnergyDrift(const History &h)
{
  double drift = 0, most = 0;
  for (const auto &x : h.x) {
    hhtex::Widen(drift, x[Kinetic] + x[Potential], h.x[0][Kinetic] + h.x[0][Potential]);
    most = std::max(most, x[Kinetic]);
  }
  return drift / most;
}

/* Prints the largest differences from another history: position of the tip; deflection and force in the pin relative to their largest values */
static PetscErrorCode Compare(const History &h, const History &other, const Line &line)
{
  double tip = 0, deflection = 0, pin = 0, most = 0, force = 0;
  PetscFunctionBeginUser;
  for (std::size_t k = 0; k < h.time.size() && k < other.time.size(); k++) {
    const std::vector<double> &a = h.x[k], &b = other.x[k];
    hhtex::Widen(tip, std::hypot(a[TipX] - b[TipX], a[TipZ] - b[TipZ]));
    hhtex::Widen(deflection, h.deflection(k, line.hub, line.share), other.deflection(k, line.hub, line.share));
    hhtex::Widen(pin, std::hypot(a[PinX] - b[PinX], a[PinZ] - b[PinZ]));
    most  = std::max(most, std::fabs(other.deflection(k, line.hub, line.share)));
    force = std::max(force, std::hypot(b[PinX], b[PinZ]));
  }
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "difference: %s from %s: tip=%.3e m, deflection=%.3e m", h.name.c_str(),
                        other.name.c_str(), tip, deflection));
  if (most > deflection) PetscCall(PetscPrintf(PETSC_COMM_WORLD, " (%.3g %% of %.3e)", 100 * deflection / most, most));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, ", pin=%.3g %% of %.1f N\n", 100 * pin / force, force));
  PetscFunctionReturn(0);
}

static PetscErrorCode Stress(const Pendulum &p, const ReducedBody &body, const HotSpots &hot, const History &h)
{
  std::vector<HotSpot> spots;
  PetscFunctionBeginUser;
  PetscCall(hot.highest(p.spots, p.width / 2, &spots));
  PetscCall(
      PetscPrintf(PETSC_COMM_WORLD, "hot spots:  node        x        y        z [m]   von Mises [MPa]   time [s]\n"));
  for (const HotSpot &s : spots)
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "       %9d %8.4f %8.4f %8.4f       %12.4f     %9.4f\n", (int)s.label,
                          s.position(0), s.position(1), s.position(2), 1e-6 * s.stress, s.time));
  if (p.field.empty() || spots.empty()) PetscFunctionReturn(0);
  const std::size_t k = (std::size_t)(std::find(h.time.begin(), h.time.end(), spots[0].time) - h.time.begin());
  PetscCheck(k < h.time.size(), PETSC_COMM_WORLD, PETSC_ERR_PLIB,
             "the time of the largest stress is not one of the samples");
  PetscCall(WriteField(body, Eigen::Map<const Eigen::VectorXd>(h.x[k].data() + Modal, body.modal.modes()), p.field));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "field: %s at t=%.4f s\n", p.field.c_str(), spots[0].time));
  PetscFunctionReturn(0);
}

/* Plots the histories above, and their differences from the first one below */
static PetscErrorCode Plot(const std::vector<History> &all, const Line &line, const std::string &file)
{
  PetscMPIInt rank;
  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  if (rank) PetscFunctionReturn(0);
  if (std::system("command -v gnuplot >/dev/null 2>&1")) {
    PetscCall(PetscPrintf(PETSC_COMM_SELF, "no picture: gnuplot is not installed (Debian: gnuplot-nox)\n"));
    PetscFunctionReturn(0);
  }
  FILE *g = popen("gnuplot", "w");
  PetscCheck(g, PETSC_COMM_SELF, PETSC_ERR_SYS, "gnuplot could not be started");
  for (std::size_t i = 0; i < all.size(); i++) {
    fprintf(g, "$h%zu << END\n", i);
    for (std::size_t k = 0; k < std::min(all[i].time.size(), all[0].time.size()); k++) {
      const auto  &x = all[i].x[k], &first = all[0].x[k];
      const double d = all[i].deflection(k, line.hub, line.share);
      fprintf(g, "%g %g %g %g %g\n", all[i].time[k], 1e3 * d, std::hypot(x[PinX], x[PinZ]),
              1e3 * (d - all[0].deflection(k, line.hub, line.share)),
              std::hypot(x[PinX] - first[PinX], x[PinZ] - first[PinZ]));
    }
    fprintf(g, "END\n");
  }
  fprintf(g,
          "set terminal pngcairo size 1400,900 font ',11'\nset output '%s'\nset multiplot layout 2,2\nset grid\nset "
          "xlabel 't [s]'\nset "
          "key top left\n",
          file.c_str());
  static const char *const label[] = {"deflection of the middle [mm]", "force in the pin [N]",
                                      "deflection: difference from ", "force: difference from "};
  for (int panel = 0; panel < 4; panel++) {
    fprintf(g, "set ylabel '%s%s'\n", label[panel],
            panel < 2 ? "" : (all[0].name + (panel == 2 ? " [mm]" : " [N]")).c_str());
    for (std::size_t i = panel / 2; i < all.size(); i++)
      fprintf(g, "%s$h%zu using 1:%d with lines lw %g lc %zu title '%s'",
              i == (std::size_t)(panel / 2) ? "plot " : ", ", i, 2 + panel, i == 0 ? 3. : 1.2, i + 1,
              all[i].name.c_str());
    fprintf(g, "\n");
    if (all.size() < 2 && panel == 1) break;
  }
  fprintf(g, "unset multiplot\nunset output\n");
  PetscCheck(pclose(g) == 0, PETSC_COMM_SELF, PETSC_ERR_LIB, "gnuplot failed");
  PetscCall(PetscPrintf(PETSC_COMM_SELF, "picture: %s\n", file.c_str()));
  PetscFunctionReturn(0);
}

/* ---- the program ---- */

static PetscErrorCode Options(Pendulum *p)
{
  PetscInt  modes[16], count = 16;
  PetscBool given, full      = PETSC_FALSE;
  PetscFunctionBeginUser;
  for (auto &o : {std::make_pair("-size", &p->size),
                  {"-thickness", &p->thickness},
                  {"-tip", &p->tip},
                  {"-end", &p->end},
                  {"-speed", &p->speed}}) {
    PetscCall(PetscOptionsGetReal(nullptr, nullptr, o.first, o.second, nullptr));
    PetscCheck(*o.second > 0 || o.second == &p->speed, PETSC_COMM_WORLD, PETSC_ERR_ARG_OUTOFRANGE,
               "%s %g: must be positive", o.first, *o.second);
  }
  for (auto &o : {std::make_pair("-samples", &p->samples), {"-spots", &p->spots}}) {
    PetscCall(PetscOptionsGetInt(nullptr, nullptr, o.first, o.second, nullptr));
    PetscCheck(*o.second > 0, PETSC_COMM_WORLD, PETSC_ERR_ARG_OUTOFRANGE, "%s %d: must be positive", o.first,
               (int)*o.second);
  }
  for (auto &o : {std::make_pair("-body", &p->body),
                  {"-o", &p->out},
                  {"-save_mesh", &p->mesh},
                  {"-stress", &p->field},
                  {"-plot", &p->plot}}) {
    char text[PETSC_MAX_PATH_LEN] = "";
    PetscCall(PetscOptionsGetString(nullptr, nullptr, o.first, text, sizeof text, nullptr));
    *o.second = text;
  }
  PetscCall(PetscOptionsGetIntArray(nullptr, nullptr, "-modes", modes, &count, &given));
  if (given) p->modes.assign(modes, modes + count);
  PetscCheck(!p->modes.empty(), PETSC_COMM_WORLD, PETSC_ERR_ARG_WRONG, "-modes: no number is given");
  PetscCall(PetscOptionsGetBool(nullptr, nullptr, "-full", &full, nullptr));
  p->full = full;
  PetscCheck(!p->full || p->body.empty(), PETSC_COMM_WORLD, PETSC_ERR_ARG_INCOMP,
             "-full needs the finite-element model, which a file of -body does not hold");
  PetscFunctionReturn(0);
}

static PetscErrorCode Check(const Pendulum &p, const ReducedBody &body)
{
  PetscFunctionBeginUser;
  for (const char *name : {"hub", "middle", "tip"})
    PetscCheck(body.modal.attachment(name) >= 0, PETSC_COMM_WORLD, PETSC_ERR_ARG_WRONG,
               "%s has no attachment %s; this program needs hub, middle and tip", p.body.c_str(), name);
  PetscFunctionReturn(0);
}

/* One run of the modal body, with stress if its file has stress modes */
static PetscErrorCode RunModal(const Pendulum &p, const ReducedBody &body, bool report, History *h)
{
  HotSpots hot(body);
  PetscInt stressed = (PetscInt)body.stress.node.size();
  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &stressed, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  h->name = std::to_string(body.modal.modes()) + " modes";
  PetscCall(SwingModal(p, body, report && stressed ? &hot : nullptr, h));
  const std::vector<double> &x = h->x.back();
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "tip: t=%.4f x=%.9f z=%.9f energy drift=%.3e of the largest kinetic energy, %.3g s\n",
                        h->time.back(), x[TipX], x[TipZ], EnergyDrift(*h), h->seconds));
  if (report && stressed)
    PetscCall(Stress(p, body, hot, *h));
  else if (report)
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "no stress: %s holds no stress modes\n", p.body.c_str()));
  PetscFunctionReturn(0);
}

static PetscErrorCode Run(void)
{
  Pendulum             p;
  FeModel              model(PETSC_COMM_WORLD);
  ReducedBody          body;
  std::vector<History> modal, all;
  History              rigid, full;
  PetscFunctionBeginUser;
  PetscCall(Options(&p));
  if (p.body.empty()) {
    std::string mesh;
    PetscMPIInt rank;
    PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
    PetscCall(hhtex::MakeArmMesh(p, &mesh));
    PetscCall(model.readMesh(mesh, {{"", p.material}}));
    if (p.mesh.empty() && rank == 0) std::remove(mesh.c_str());
  } else {
    p.modes.resize(1);
  }
  for (std::size_t k = 0; k < p.modes.size(); k++) {
    body = ReducedBody();
    if (p.body.empty())
      PetscCall(MakeBody(p, model, p.modes[k], &body));
    else
      PetscCall(body.load(PETSC_COMM_WORLD, p.body));
    PetscCall(Check(p, body));
    modal.emplace_back();
    PetscCall(RunModal(p, body, k + 1 == p.modes.size(), &modal.back()));
  }
  const Line line(body.modal);
  PetscCall(SwingRigid(p, body.modal, &rigid));
  if (p.full) {
    PetscCall(SwingFull(p, model, body.modal, &full));
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "full: %d nodes, %.3g s\n", (int)model.nodes, full.seconds));
    all.push_back(full);
    for (const History &h : modal) PetscCall(Compare(h, full, line));
  }
  PetscCall(Compare(modal.back(), rigid, line));
  all.insert(all.end(), modal.begin(), modal.end());
  if (!p.plot.empty()) PetscCall(Plot(all, line, p.plot));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  PetscFunctionBeginUser;
  PetscCall(SlepcInitialize(&argc, &argv, nullptr, help));
  PetscCall(TSHHT3Initialize());
  PetscCall(hhtex::SummaryByDefault());
  PetscCall(Run());
  PetscCall(SlepcFinalize());
  return 0;
}
