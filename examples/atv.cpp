static char help[] =
    "An all-terrain vehicle with a flexible frame on four shaker posts (atv_model.h says what it consists of).\n"
    "The frame comes from a file that atv_frame makes:\n"
    "  gmsh -3 -o frame.msh examples/atv_frame.geo && build/bin/atv_frame -mesh frame.msh -o frame.h5\n"
    "  -frame <frame.h5>: the reduced frame\n"
    "  -end <2> -step_max <5e-4>: end time and largest step, s (0: as the tolerance allows)\n"
    "  -stress: the ten places of largest von Mises stress in the frame;  -spots <10>: how many\n"
    "  -field <prefix> -field_dt <0.02>: the frame with its stress for ParaView, prefix.pvd\n"
    "  -modes <0>: that many of the slowest modes of the vehicle at rest\n"
    "  -scene_csv <file.csv>, -scene_animation <prefix>: channels every 4 ms; all parts for ParaView\n"
    "  -scene_page <file.html>: all parts and the frame's stress in a page that any browser opens\n";

#include "atv_model.h"
#include "atv_surface.h"
#include "problem.h"
#include "scene_watch.h"

#include <fstream>
#include <hhtdae/flexible.h>
#include <hhtdae/modes.h>

using namespace hhtdae;

struct Settings {
  std::string frame = "frame.h5", field;
  PetscReal   end = 2, step_max = 5e-4, field_dt = 0.02;
  PetscBool   stress = PETSC_FALSE, page = PETSC_FALSE;
  PetscInt    spots  = 10, modes = 0;
};

static PetscErrorCode ReadSettings(Settings *s)
{
  char      text[PETSC_MAX_PATH_LEN];
  PetscBool given;
  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetString(nullptr, nullptr, "-frame", text, sizeof(text), &given));
  if (given) s->frame = text;
  PetscCall(PetscOptionsGetString(nullptr, nullptr, "-field", text, sizeof(text), &given));
  if (given) s->field = text;
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-end", &s->end, nullptr));
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-step_max", &s->step_max, nullptr));
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-field_dt", &s->field_dt, nullptr));
  PetscCall(PetscOptionsGetBool(nullptr, nullptr, "-stress", &s->stress, nullptr));
  PetscCall(PetscOptionsHasName(nullptr, nullptr, "-scene_page", &s->page));
  PetscCall(PetscOptionsGetInt(nullptr, nullptr, "-spots", &s->spots, nullptr));
  PetscCall(PetscOptionsGetInt(nullptr, nullptr, "-modes", &s->modes, nullptr));
  PetscCheck(s->end > 0 && s->step_max >= 0 && s->field_dt > 0 && s->spots > 0, PETSC_COMM_WORLD,
             PETSC_ERR_ARG_OUTOFRANGE, "-end, -field_dt and -spots must be positive, -step_max not negative");
  PetscFunctionReturn(0);
}

/* The frame's stress through time, for ParaView: a file per picture, and their list */
class FieldSeries
{
public:
  FieldSeries(const Settings &s, const hhtex::Atv &atv, const ReducedBody &body) : s_(s), atv_(atv), body_(body) {}

  PetscErrorCode add(double t, const std::vector<double> &channels)
  {
    Vector3 origin;
    Matrix3 axes;
    PetscFunctionBeginUser;
    if (t < (double)files_.size() * s_.field_dt * (1 - 1e-9)) PetscFunctionReturn(0);
    char name[PETSC_MAX_PATH_LEN];
    PetscCall(PetscSNPrintf(name, sizeof(name), "%s_%06d.vtu", s_.field.c_str(), (int)files_.size()));
    atv_.pose(channels, &origin, &axes);
    PetscCall(WriteField(body_, atv_.modes(channels), name, origin, axes));
    files_.emplace_back(t, name);
    PetscFunctionReturn(0);
  }

  PetscErrorCode finish() const
  {
    PetscMPIInt rank;
    PetscFunctionBeginUser;
    PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
    if (rank) PetscFunctionReturn(0);
    std::ofstream out(s_.field + ".pvd");
    out << "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\">\n<Collection>\n";
    for (const auto &[t, name] : files_)
      out << "<DataSet timestep=\"" << t << "\" part=\"0\" file=\""
          << name.substr(name.rfind('/') == std::string::npos ? 0 : name.rfind('/') + 1) << "\"/>\n";
    out << "</Collection>\n</VTKFile>\n";
    out.close();
    PetscCheck(out, PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "%s.pvd cannot be written", s_.field.c_str());
    PetscFunctionReturn(0);
  }

private:
  const Settings                             &s_;
  const hhtex::Atv                           &atv_;
  const ReducedBody                          &body_;
  std::vector<std::pair<double, std::string>> files_;
};

static PetscErrorCode PrintSpots(const HotSpots &hot, PetscInt count)
{
  std::vector<HotSpot> spots;
  PetscFunctionBeginUser;
  PetscCall(hot.highest(count, 0.05, &spots));
  PetscCall(
      PetscPrintf(PETSC_COMM_WORLD, "hot spots:  node        x        y        z [m]   von Mises [MPa]   time [s]\n"));
  for (const HotSpot &s : spots)
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "       %9d %8.4f %8.4f %8.4f       %12.4f     %9.4f\n", (int)s.label,
                          s.position(0), s.position(1), s.position(2), 1e-6 * s.stress, s.time));
  PetscFunctionReturn(0);
}

static PetscErrorCode CreateTS(const Settings &s, hhtex::Atv &atv, TS *ts)
{
  TSAdapt adapt;
  PetscFunctionBeginUser;
  PetscCall(atv.scene.createTS(ts));
  PetscCall(TSSetMaxTime(*ts, s.end));
  PetscCall(TSSetMaxSteps(*ts, 100000000));
  PetscCall(TSSetTolerances(*ts, 1e-5, nullptr, 1e-5, nullptr));
  PetscCall(TSGetAdapt(*ts, &adapt));
  if (s.step_max > 0) PetscCall(TSAdaptSetStepLimits(adapt, PETSC_DEFAULT, s.step_max));
  PetscCall(TSSetFromOptions(*ts));
  PetscFunctionReturn(0);
}

/* Prints the slowest modes about the equilibrium in which the run starts */
static PetscErrorCode PrintModes(TS ts, const hhtex::Atv &atv, PetscInt count)
{
  Linearization     small;
  std::vector<Mode> modes;
  PetscFunctionBeginUser;
  PetscCall(small.take(ts));
  PetscCall(SlowestModes(small, count, &modes));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "mode  frequency Hz  damping ratio  frame's part of the energy\n"));
  for (std::size_t k = 0; k < modes.size(); k++) {
    BodyPart frame;
    PetscCall(small.part(modes[k], atv.frame, &frame));
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%4d  %12.5f  %13.5f  %10.3f\n", (int)k + 1, modes[k].frequency(), modes[k].dampingRatio(), frame.share));
  }
  PetscFunctionReturn(0);
}

static PetscErrorCode Run()
{
  Settings       s;
  auto           model = std::make_shared<ModalBody>();
  TS             ts;
  PetscErrorCode failed = 0;

  PetscFunctionBeginUser;
  PetscCall(ReadSettings(&s));
  PetscCall(LoadModalBody(PETSC_COMM_WORLD, s.frame, model.get()));
  hhtex::Atv  atv(PETSC_COMM_WORLD, model);
  ReducedBody body; /* with stress modes, if stress or pictures are requested */
  const bool  recover = s.stress || !s.field.empty();
  if (recover) atv.watchFrame();
  if (recover || s.page) PetscCall(body.load(PETSC_COMM_WORLD, s.frame));
  if (s.page) PetscCall(hhtex::ShowAtvFrame(body, &atv));
  PetscCall(CreateTS(s, atv, &ts));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "atv: %d parts, %d joints, %d motions, %d modes\n", (int)atv.parts,
                        (int)atv.joints, (int)atv.motions, (int)model->modes()));
  HotSpots     hot(body);
  FieldSeries  series(s, atv, body);
  hhtex::Watch watch(atv.scene, atv.scene.output().dt, [&](double t, const std::vector<double> &x) {
    if (!failed && s.stress) failed = hot.add(t, atv.modes(x));
    if (!failed && !s.field.empty()) failed = series.add(t, x);
  });
  if (recover) PetscCall(watch.attach(ts));
  if (s.modes > 0) PetscCall(PrintModes(ts, atv, s.modes));
  PetscCall(atv.scene.solve(ts));
  PetscCall(failed);
  if (s.stress) PetscCall(PrintSpots(hot, s.spots));
  if (!s.field.empty()) PetscCall(series.finish());
  PetscCall(TSDestroy(&ts));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, nullptr, help));
  PetscCall(TSHHT3Initialize());
  PetscCall(hhtex::SummaryByDefault());
  PetscCall(Run());
  PetscCall(PetscFinalize());
  return 0;
}
