static char help[] =
    "Lowest frequencies of a plate from finite elements, against plate theory.\n"
    "The plate is meshed by the program gmsh with bricks of 20 nodes, or tetrahedra; runs on any number of ranks.\n"
    "  -a <1> -b <0.8> -thickness <0.02>: sides and thickness, m\n"
    "  -support <simple>: all four sides simple, clamped or free\n"
    "  -size <0.05>: of the elements along the plate, m;  -layers <2>: elements through the thickness\n"
    "  -tetrahedra: with 10 nodes, in place of bricks\n"
    "  -mesh <file>: instead, any mesh of Gmsh, unsupported\n"
    "  -E <2.1e11> -nu <0.3> -rho <7850>: N/m^2, none, kg/m^3\n"
    "  -n <10>: number of modes\n";

#include <hhtdae/flexible.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <petsctime.h>
#include <slepceps.h>
#include <unistd.h>

using namespace hhtdae;

struct Plate {
  double   a = 1, b = 0.8, h = 0.02, size = 0.05;
  PetscInt layers     = 2;
  bool     tetrahedra = false, simple = true, clamped = false;
  Material material{2.1e11, 0.3, 7850};
};

/* A mode of plate theory: half waves along x and y, and frequencies in Hz by Mindlin and by Kirchhoff */
struct Mode {
  const char *kind;
  int         m, n;
  double      thick, thin;
};

/* ---- the mesh ---- */

static PetscErrorCode MakeMesh(const Plate &p, std::string *file)
{
  PetscMPIInt rank;
  int         failed = 0;
  char        name[PETSC_MAX_PATH_LEN];
  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCall(PetscGetTmp(PETSC_COMM_WORLD, name, sizeof name));
  int number = (int)getpid(); /* one name on all ranks */
  PetscCallMPI(MPI_Bcast(&number, 1, MPI_INT, 0, PETSC_COMM_WORLD));
  const std::string stem = std::string(name) + "/platemodes" + std::to_string(number);
  *file                  = stem + ".msh";
  if (rank == 0) {
    std::ofstream geo(stem + ".geo");
    geo << "Point(1) = {0, 0, 0, " << p.size << "}; Point(2) = {" << p.a << ", 0, 0, " << p.size << "};\n"
        << "Point(3) = {" << p.a << ", " << p.b << ", 0, " << p.size << "}; Point(4) = {0, " << p.b << ", 0, " << p.size
        << "};\n"
        << "Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 1};\n"
        << "Curve Loop(1) = {1, 2, 3, 4}; Plane Surface(1) = {1};\n";
    if (!p.tetrahedra) geo << "Transfinite Surface{1}; Recombine Surface{1};\n";
    geo << "e[] = Extrude {0, 0, " << p.h << "} { Surface{1}; Layers{" << p.layers << "};"
        << (p.tetrahedra ? "" : " Recombine;") << " };\n"
        << "Physical Volume(\"plate\") = {e[1]};\n"
        << "Physical Surface(\"ends of x\") = {e[3], e[5]};\n"
        << "Physical Surface(\"ends of y\") = {e[2], e[4]};\n"
        << "Mesh.ElementOrder = 2; Mesh.SecondOrderIncomplete = 1;\n";
    geo.close();
    failed = std::system(("gmsh -v 1 -3 -format msh41 -o " + *file + " " + stem + ".geo").c_str()) != 0;
    std::remove((stem + ".geo").c_str());
  }
  PetscCallMPI(MPI_Bcast(&failed, 1, MPI_INT, 0, PETSC_COMM_WORLD));
  PetscCheck(!failed, PETSC_COMM_WORLD, PETSC_ERR_LIB,
             "the program gmsh failed or is not installed; give a mesh with -mesh");
  PetscFunctionReturn(0);
}

/* Degrees of freedom of this rank that are not supported. Nodes of a simply supported side do not move in the plane of that side. */
static std::vector<PetscInt> FreeRows(const FeModel &model, const Plate &p)
{
  std::vector<bool> held(3 * model.own, false);
  for (int side = 0; side < 2; side++) {
    const auto set = model.sets.find(side ? "ends of y" : "ends of x");
    if (set == model.sets.end()) continue;
    for (PetscInt n : set->second)
      for (int d = 0; d < 3; d++)
        if (p.clamped || (p.simple && d != side)) held[3 * (n - model.first) + d] = true;
  }
  std::vector<PetscInt> rows;
  for (PetscInt i = 0; i < 3 * model.own; i++)
    if (!held[i]) rows.push_back(3 * model.first + i);
  return rows;
}

/* ---- frequencies ---- */

/* Lowest frequencies in Hz, by Krylov-Schur with shift-and-invert; rigid motions are only counted */
static PetscErrorCode Frequencies(const FeModel &model, const std::vector<PetscInt> &rows, double shift, PetscInt count,
                                  std::vector<double> *hertz, PetscInt *rigid)
{
  IS       free;
  Mat      K, M;
  EPS      eps;
  ST       st;
  KSP      ksp;
  PC       pc;
  PetscInt found;
  PetscFunctionBeginUser;
  PetscCall(ISCreateGeneral(model.comm, (PetscInt)rows.size(), rows.data(), PETSC_COPY_VALUES, &free));
  PetscCall(MatCreateSubMatrix(model.K, free, free, MAT_INITIAL_MATRIX, &K));
  PetscCall(MatCreateSubMatrix(model.M, free, free, MAT_INITIAL_MATRIX, &M));
  PetscCall(ISDestroy(&free));
  PetscCall(EPSCreate(model.comm, &eps));
  PetscCall(EPSSetOperators(eps, K, M));
  PetscCall(EPSSetProblemType(eps, EPS_GHEP));
  PetscCall(EPSSetDimensions(eps, count + 6, PETSC_DEFAULT, PETSC_DEFAULT));
  PetscCall(EPSSetTarget(eps, shift)); /* below all eigenvalues: a free plate has zeros */
  PetscCall(EPSSetWhichEigenpairs(eps, EPS_TARGET_MAGNITUDE));
  PetscCall(EPSGetST(eps, &st));
  PetscCall(STSetType(st, STSINVERT));
  PetscCall(STGetKSP(st, &ksp));
  PetscCall(KSPSetType(ksp, KSPPREONLY));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCSetType(pc, PCCHOLESKY));
  PetscCall(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS));
  PetscCall(EPSSetFromOptions(eps));
  PetscCall(EPSSolve(eps));
  PetscCall(EPSGetConverged(eps, &found));
  *rigid = 0;
  for (PetscInt i = 0; i < found; i++) {
    PetscScalar lambda;
    PetscCall(EPSGetEigenvalue(eps, i, &lambda, nullptr));
    if (std::abs(lambda) < 1e-3 * std::abs(shift))
      ++*rigid;
    else if ((PetscInt)hertz->size() < count)
      hertz->push_back(std::sqrt(lambda) / (2 * PETSC_PI));
  }
  std::sort(hertz->begin(), hertz->end());
  PetscCall(EPSDestroy(&eps));
  PetscCall(MatDestroy(&K));
  PetscCall(MatDestroy(&M));
  PetscFunctionReturn(0);
}

/* ---- theory ---- */

/*
  Simply supported: w = sin(m pi x / a) sin(n pi y / b), wave number k. Kirchhoff: omega = k^2 sqrt(D / (rho h)).
  Mindlin (1951), with shear and rotary inertia, S = 5/6 G h: (S k^2 - rho h omega^2)(D k^2 + S - rho h^3 / 12 omega^2)
  = S^2 k^2. Motions in the plane: shear omega = k c_T, and stretching with the wave speed of plane stress.
*/
static std::vector<Mode> SimplySupported(const Plate &p)
{
  const Material &s = p.material;
  const double D = s.young * std::pow(p.h, 3) / (12 * (1 - s.poisson * s.poisson)), G = s.young / (2 * (1 + s.poisson));
  const double S = 5. / 6 * G * p.h, mass = s.density * p.h, turn = s.density * std::pow(p.h, 3) / 12;
  std::vector<Mode> modes;
  for (int m = 0; m < 30; m++)
    for (int n = 0; n < 30; n++) {
      const double k = PETSC_PI * std::hypot(m / p.a, n / p.b), k2 = k * k, hz = 1 / (2 * PETSC_PI);
      if (m + n) modes.push_back({"shear", m, n, hz * k * std::sqrt(G / s.density), hz * k * std::sqrt(G / s.density)});
      if (!m || !n) continue;
      const double stretch = hz * k * std::sqrt(s.young / (s.density * (1 - s.poisson * s.poisson)));
      modes.push_back({"stretch", m, n, stretch, stretch});
      const double A = mass * turn, B = S * k2 * turn + mass * (D * k2 + S), C = S * k2 * D * k2;
      modes.push_back(
          {"bending", m, n, hz * std::sqrt(2 * C / (B + std::sqrt(B * B - 4 * A * C))), hz * k2 * std::sqrt(D / mass)});
    }
  std::sort(modes.begin(), modes.end(), [](const Mode &x, const Mode &y) { return x.thick < y.thick; });
  return modes;
}

/* Square plates with nu = 0.3 after Kirchhoff: omega a^2 sqrt(rho h / D) = 13.47 ... (free) and 35.99 ... (clamped),
   from Leissa, The free vibration of rectangular plates, J. Sound Vib. 31 (1973); his upper bounds, up to one percent
   high for the free plate */
static std::vector<Mode> Tabulated(const Plate &p)
{
  const std::vector<double> free    = {13.489, 19.789, 24.432, 35.024, 35.024, 61.526},
                            clamped = {35.992, 73.413, 73.413, 108.27, 131.64, 132.24};
  std::vector<Mode> modes;
  if (std::abs(p.a - p.b) > 1e-9 * p.a || std::abs(p.material.poisson - 0.3) > 1e-9) return modes;
  const double D = p.material.young * std::pow(p.h, 3) / (12 * (1 - 0.09));
  for (double l : p.clamped ? clamped : free)
    modes.push_back({"bending", 0, 0, 0, l / (p.a * p.a) * std::sqrt(D / (p.material.density * p.h)) / (2 * PETSC_PI)});
  return modes;
}

/* ---- the program ---- */

static PetscErrorCode Options(Plate *p, std::string *mesh, PetscInt *count)
{
  char      text[PETSC_MAX_PATH_LEN] = "", support[16] = "simple";
  PetscBool given, tetrahedra                          = PETSC_FALSE;
  PetscFunctionBeginUser;
  for (auto &o : {std::make_pair("-a", &p->a),
                  {"-b", &p->b},
                  {"-thickness", &p->h},
                  {"-size", &p->size},
                  {"-E", &p->material.young},
                  {"-nu", &p->material.poisson},
                  {"-rho", &p->material.density}}) {
    PetscCall(PetscOptionsGetReal(nullptr, nullptr, o.first, o.second, nullptr));
    PetscCheck(*o.second > 0, PETSC_COMM_WORLD, PETSC_ERR_ARG_OUTOFRANGE, "%s %g: must be positive", o.first,
               *o.second);
  }
  PetscCall(PetscOptionsGetInt(nullptr, nullptr, "-layers", &p->layers, nullptr));
  PetscCall(PetscOptionsGetInt(nullptr, nullptr, "-n", count, nullptr));
  PetscCheck(p->layers > 0 && *count > 0, PETSC_COMM_WORLD, PETSC_ERR_ARG_OUTOFRANGE,
             "-layers and -n must be positive");
  PetscCall(PetscOptionsGetBool(nullptr, nullptr, "-tetrahedra", &tetrahedra, nullptr));
  PetscCall(PetscOptionsGetString(nullptr, nullptr, "-support", support, sizeof support, nullptr));
  PetscCall(PetscOptionsGetString(nullptr, nullptr, "-mesh", text, sizeof text, &given));
  *mesh         = text;
  p->tetrahedra = tetrahedra;
  p->clamped    = !std::strcmp(support, "clamped");
  p->simple     = !std::strcmp(support, "simple") && !given;
  PetscCheck(given || p->clamped || p->simple || !std::strcmp(support, "free"), PETSC_COMM_WORLD, PETSC_ERR_ARG_WRONG,
             "-support %s: must be simple, clamped or free", support);
  PetscFunctionReturn(0);
}

static PetscErrorCode Table(const std::vector<double> &hertz, const std::vector<Mode> &theory)
{
  PetscFunctionBeginUser;
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "mode    FE [Hz]   Mindlin [Hz]  Kirchhoff [Hz]   difference\n"));
  for (std::size_t i = 0; i < hertz.size(); i++) {
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%4d %10.3f", (int)i + 1, hertz[i]));
    if (i < theory.size()) {
      const Mode &t = theory[i];
      if (t.thick > 0)
        PetscCall(PetscPrintf(PETSC_COMM_WORLD, "   %12.3f    %12.3f %+11.4f %%  %s %d,%d", t.thick, t.thin,
                              100 * (hertz[i] / t.thick - 1), t.kind, t.m, t.n));
      else
        PetscCall(PetscPrintf(PETSC_COMM_WORLD, "              -    %12.3f %+11.4f %%", t.thin,
                              100 * (hertz[i] / t.thin - 1)));
    }
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "\n"));
  }
  PetscFunctionReturn(0);
}

static PetscErrorCode Run(void)
{
  Plate               p;
  std::string         mesh;
  PetscInt            count = 10, rigid = 0;
  std::vector<double> hertz;
  PetscLogDouble      start, read, end;
  PetscMPIInt         rank;
  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  PetscCall(Options(&p, &mesh, &count));
  const bool own_mesh = mesh.empty();
  if (own_mesh) PetscCall(MakeMesh(p, &mesh));

  PetscCall(PetscTime(&start));
  FeModel model(PETSC_COMM_WORLD);
  PetscCall(model.readMesh(mesh, {{"", p.material}}));
  PetscCall(PetscTime(&read));
  if (own_mesh && rank == 0) std::remove(mesh.c_str());

  /* The shift is negative, and small compared with the first eigenvalue of a bending plate */
  double box[6] = {PETSC_MAX_REAL, PETSC_MAX_REAL, PETSC_MAX_REAL, PETSC_MAX_REAL, PETSC_MAX_REAL, PETSC_MAX_REAL};
  for (PetscInt i = 0; i < 3 * model.own; i++) {
    box[i % 3]     = std::min(box[i % 3], model.coordinates[i]);
    box[3 + i % 3] = std::min(box[3 + i % 3], -model.coordinates[i]);
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, box, 6, MPI_DOUBLE, MPI_MIN, PETSC_COMM_WORLD));
  double length = 0;
  for (int d = 0; d < 3; d++) length = std::max(length, -box[3 + d] - box[d]);
  const double shift = -1e-4 * p.material.young / (p.material.density * length * length);

  PetscCall(Frequencies(model, FreeRows(model, p), shift, count, &hertz, &rigid));
  PetscCall(PetscTime(&end));
  std::vector<Mode> theory;
  if (own_mesh) theory = p.simple ? SimplySupported(p) : Tabulated(p);
  PetscCall(Table(hertz, theory));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "platemodes: nodes=%d rigid=%d read=%.3g s modes=%.3g s\n", (int)model.nodes,
                        (int)rigid, read - start, end - read));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  PetscCall(SlepcInitialize(&argc, &argv, nullptr, help));
  PetscCall(Run());
  PetscCall(SlepcFinalize());
  return 0;
}
