/* Parses and checks the command line of hhtreduce, before any work is done. */
#include "options.h"
#include <algorithm>
#include <cmath>
#include <cstring>
#include <set>

namespace hhtreduce
{

using namespace hhtdae;

const char *const help =
    "hhtreduce: finite-element models to flexible bodies in modal coordinates\n"
    "\n"
    "  hhtreduce -mesh frame.msh -material 2.1e11,0.3,7850 -attach hub:hub_nodes,tip:tip_nodes:average -modes 20 -o "
    "frame.h5\n"
    "  hhtreduce -info frame.h5\n"
    "  hhtreduce -vtu mode3.vtu -mode 3 frame.h5\n"
    "  mpiexec -n 4 hhtreduce ...           all of it runs on any number of ranks\n"
    "\n"
    "The model, one of\n"
    "  -mesh <file.msh>         mesh of Gmsh: tetrahedra with 4 or 10 nodes, bricks with 8 or 20; physical groups are "
    "sets of nodes;\n"
    "                           those of a surface and a volume of one name are \"surface rod\" and \"volume rod\"\n"
    "    -material <E,nu,rho>   of all volumes, or  <name:E,nu,rho;name2:E,nu,rho>  by physical volumes (quote the "
    "semicolon)\n"
    "  -calculix <stem>         stem.inp and what ccx wrote for it with *FREQUENCY,SOLVER=MATRIXSTORAGE: stem.dof, "
    "stem.sti, stem.mas\n"
    "  -stiffness <file>, -mass <file>\n"
    "                           Matrix Market, lines \"i j value\" as of Abaqus, or PETSc's binary; three unknowns a "
    "node, no supports\n"
    "    -nodes <file>          lines \"label x y z\" in the order of the matrices' rows\n"
    "    -sets <file>           lines \"name label label ...\"\n"
    "\n"
    "Attachments, where joints and forces take hold\n"
    "  -attach <name:set[:rigid|:average][@x,y,z],...>\n"
    "                           a set of nodes that follows the point rigidly, or whose mean motion the point follows; "
    "the point is at\n"
    "                           x,y,z or at the centroid of the nodes; a name alone is also that of the set\n"
    "\n"
    "Reduction\n"
    "  -method <craigbampton>   craigbampton, freefree or static\n"
    "  -modes <20>              largest number of normal modes\n"
    "  -max_frequency <f>       highest frequency of normal modes, cycles per unit of time; without -modes: all below it\n"
    "  -keep_below <f>          keeps the modes of the reduced body below this frequency\n"
    "  -keep <0,1,5-9>          keeps the modes of the reduced body with these numbers, from 0\n"
    "  -stiffening              geometric stiffening by loads on the attachments and by angular velocity\n"
    "  -keep_nodes <set,17,20-30,...>\n"
    "                           nodes for markers, forces and contact of a scene: of sets and by number\n"
    "  -pressure <name:set[:follows|:fixed],...>\n"
    "                           load case: unit pressure, inwards, on the outer faces whose nodes are all in the set; it follows the "
    "deformed\n"
    "                           surface, or its forces are fixed in the axes of the body\n"
    "  -load <name:file,...>    load case: forces on nodes, lines \"label fx fy fz\"\n"
    "  -stress                  adds stress modes, for stress over time and pictures\n"
    "  -no_shapes               writes only what scenes need: no nodes, no pictures\n"
    "\n"
    "The file\n"
    "  -o <body.h5>             where the reduced body goes (HDF5)\n"
    "  -units <text>            a note in the file, such as \"m, kg, s\"; any consistent units may be used\n"
    "  -name <text>             name of the body; default: the output's name without its ending\n"
    "  -quiet                   no progress, no table\n"
    "\n"
    "A body's file\n"
    "  -info <body.h5>          table of modes with frequency and residual, mass, centre, inertia, attachments, "
    "origin; the checksum is\n"
    "                           verified\n"
    "  -vtu <file.vtu> -mode <k> [-scale <s>] <body.h5>\n"
    "                           mode k, from 0, for ParaView: displacement, and stress if the body has stress modes; s "
    "is the modal\n"
    "                           coordinate, else the largest displacement is a twentieth of the body's size\n"
    "    -body <body.h5>        the same as the file's name by itself\n"
    "\n"
    "  -traceback               errors with PETSc's trace of calls\n"
    "\n"
    "Solvers: options of PETSc and SLEPc with the prefix reduce_, which -help with a task lists, except the last four\n"
    "  -reduce_eps_type, -reduce_eps_tol <1e-11>, -reduce_eps_max_it <200>, -reduce_eps_ncv, ...\n"
    "                           of normal modes\n"
    "  -reduce_ksp_type, -reduce_pc_type, -reduce_pc_factor_mat_solver_type, ...\n"
    "                           of constraint modes and residuals; the default is L D L^T by MUMPS\n"
    "  -reduce_eps_krylov_block <6>\n"
    "                           vectors in a block of the block Krylov method, the default for normal modes\n"
    "  -reduce_slices_from <400>\n"
    "                           with at least so many modes below -max_frequency, these are computed by intervals of frequencies\n"
    "  -reduce_verify <true>    counts modes by the inertia of a matrix, so that none of several equal ones is missing\n"
    "  -fe_mass_points <exact>  of meshes: exact, or stiffness, the points at which the stiffness is integrated\n"
    "All other options of PETSc can be used (-log_view, -options_left ...).\n"
    "\n"
    "Layout of the file (HDF5, little-endian, format \"hhtdae reduced body\" version 4; n modes, a attachments, N "
    "nodes, S nodes with stress)\n"
    "  attributes of /: format, version, program, source, method, units, name, fe_nodes, elastic_scale, checksum\n"
    "  /modal        mass {1}, center {3}, moments {3,3}, omega {n}, first {n,3}, moment {3,n,3}, quadratic {6,n,n},\n"
    "                stiffening {6,n,n}\n"
    "  /modes        frequency {n}, residual {n}: eta, in the norm of the full model's stiffness; omega^2 is within eta of "
    "one of its eigenvalues,\n"
    "                relative to it, and about eta^2 too high (version 1 had residuals of forces, read as not known: negative)\n"
    "  /attachments  name (each ends with a zero), position {a,3}, translation {a,n,3}, rotation {a,n,3},\n"
    "                stiffening {6a,n,n}\n"
    "  /kept         nodes for markers: label {k}, position {k,3}, turns {k}, translation {k,n,3}, rotation {k,n,3}\n"
    "  /loads        name, force {l,3}, moment {l,3}, modal {l,n}, moment_gradient {l,n,3}, follows {l}; of those that follow\n"
    "                force_gradient {f,n,3}, modal_gradient {f,n,n}\n"
    "  /nodes        coordinates {N,3}, label {N}, shape {n,N,3}\n"
    "  /elements     type {E}, material {E}, node\n"
    "  /stress       node {S}, values {n,S,6}: xx yy zz xy yz zx\n"
    "  every dataset has its checksum as an attribute\n";

namespace
{

const std::vector<std::string> with_value = {
    "mesh",   "material", "calculix", "stiffness",     "mass",       "nodes", "sets",
    "attach", "modes",    "method",   "max_frequency", "keep_below", "keep",  "o",
    "units",  "name",     "vtu",      "mode",          "scale",      "body",  "body_info",
    "keep_nodes", "pressure", "load"};
const std::vector<std::string> without_value = {"stress", "stiffening", "no_shapes", "quiet", "traceback"};

bool IsOption(const std::string &word)
{
  return word.size() > 1 && word[0] == '-' && (std::isalpha((unsigned char)word[1]) || word[1] == '-');
}

bool Contains(const std::vector<std::string> &list, const std::string &word)
{
  return std::find(list.begin(), list.end(), word) != list.end();
}

std::size_t Distance(const std::string &a, const std::string &b)
{
  std::vector<std::size_t> row(b.size() + 1), before;
  for (std::size_t j = 0; j <= b.size(); j++) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); i++) {
    before = row;
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); j++)
      row[j] = std::min({before[j] + 1, row[j - 1] + 1, before[j - 1] + (a[i - 1] != b[j - 1])});
  }
  return row.back();
}

/* The option of hhtreduce that a word resembles, by edit distance; "" if it is an option or resembles none */
std::string Meant(const std::string &word)
{
  for (const auto &list : {with_value, without_value})
    for (const std::string &ours : list)
      if (word != ours && Distance(word, ours) <= std::max<std::size_t>(1, ours.size() / 4) && ours.size() > 3)
        return ours;
  return "";
}

PetscErrorCode Text(const char *name, std::string *value)
{
  std::vector<char> buffer(1 << 16, '\0');
  PetscBool         given;
  PetscFunctionBegin;
  PetscCall(PetscOptionsGetString(nullptr, nullptr, name, buffer.data(), buffer.size(), &given));
  PetscCheck(!given || buffer[0], PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "%s needs a value; hhtreduce -help explains it", name);
  if (given) *value = buffer.data();
  PetscFunctionReturn(0);
}

PetscErrorCode Real(const char *name, double *value, bool *given = nullptr)
{
  std::string text;
  PetscFunctionBegin;
  PetscCall(Text(name, &text));
  if (given) *given = !text.empty();
  PetscCheck(text.empty() || Number(text, value), PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT, "%s %s is not a number", name,
             text.c_str());
  PetscFunctionReturn(0);
}

PetscErrorCode Whole(const char *name, PetscInt *value, bool *given)
{
  double number = 0;
  PetscFunctionBegin;
  PetscCall(Real(name, &number, given));
  PetscCheck(number >= 0 && number == std::floor(number) && number < 1e9, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "%s %g is not a whole number from 0 up", name, number);
  if (*given) *value = (PetscInt)number;
  PetscFunctionReturn(0);
}

PetscErrorCode Flag(const char *name, bool *value)
{
  PetscBool flag = PETSC_FALSE;
  PetscFunctionBegin;
  PetscCall(PetscOptionsGetBool(nullptr, nullptr, name, &flag, nullptr));
  *value = flag;
  PetscFunctionReturn(0);
}

PetscErrorCode ReadNodesAndLoads(Reduction *r)
{
  std::string nodes, pressures, loads, error;
  PetscFunctionBegin;
  PetscCall(Text("-keep_nodes", &nodes));
  PetscCall(Text("-pressure", &pressures));
  PetscCall(Text("-load", &loads));
  for (const std::string &part : Split(nodes, ',')) {
    if (nodes.empty()) break;
    if (part.empty()) error = "-keep_nodes " + nodes + " has an empty part";
    else if (!std::isdigit((unsigned char)part[0])) r->node_sets.push_back(part);
    else if (!(error = ParseNumbers(part, &r->nodes)).empty()) error = "-keep_nodes: " + error;
    if (!error.empty()) break;
  }
  if (error.empty() && !pressures.empty()) error = ParsePressures(pressures, &r->loads);
  if (error.empty() && !loads.empty()) error = ReadLoads(loads, &r->loads);
  PetscCheck(error.empty(), PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT, "%s", error.c_str());
  PetscFunctionReturn(0);
}

PetscErrorCode ReadReduction(Reduction *r)
{
  std::string text, method, error;
  bool        modes = false, bound = false, no_shapes;
  PetscFunctionBegin;
  PetscCall(Text("-attach", &text));
  if (!text.empty()) error = ParseAttachments(text, &r->attachments);
  PetscCheck(error.empty(), PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT, "%s", error.c_str());
  PetscCall(Text("-method", &method));
  PetscCheck(method.empty() || method == "craigbampton" || method == "freefree" || method == "static", PETSC_COMM_WORLD,
             PETSC_ERR_USER_INPUT, "-method %s is not craigbampton, freefree or static", method.c_str());
  r->method = method == "freefree" ? Method::FreeFree : method == "static" ? Method::Static : Method::CraigBampton;
  PetscCall(Whole("-modes", &r->modes, &modes));
  PetscCall(Real("-max_frequency", &r->max_frequency, &bound));
  PetscCheck(!bound || r->max_frequency > 0, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT, "-max_frequency %g is not above 0",
             r->max_frequency);
  if (bound && !modes) r->modes = PETSC_DEFAULT;
  PetscCall(Real("-keep_below", &r->keep_below, &bound));
  PetscCheck(!bound || r->keep_below > 0, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT, "-keep_below %g is not above 0",
             r->keep_below);
  text.clear();
  PetscCall(Text("-keep", &text));
  if (!text.empty()) error = ParseNumbers(text, &r->keep);
  PetscCheck(error.empty(), PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT, "-keep %s: %s", text.c_str(), error.c_str());
  PetscCall(ReadNodesAndLoads(r));
  PetscCall(Flag("-no_shapes", &no_shapes));
  r->all_nodes = !no_shapes;
  PetscCheck(r->method == Method::FreeFree || !r->attachments.empty(), PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "no attachments: give -attach name:set, or reduce the free body with -method freefree");
  PetscFunctionReturn(0);
}

std::string Stem(const std::string &file)
{
  const std::string name = file.substr(file.rfind('/') == std::string::npos ? 0 : file.rfind('/') + 1);
  return name.find('.') ? name.substr(0, name.rfind('.')) : name;
}

PetscErrorCode ReadModelOptions(Task *t)
{
  std::string material, error;
  PetscFunctionBegin;
  PetscCall(Text("-mesh", &t->mesh));
  PetscCall(Text("-calculix", &t->calculix));
  PetscCall(Text("-stiffness", &t->stiffness));
  PetscCall(Text("-mass", &t->mass));
  PetscCall(Text("-nodes", &t->nodes));
  PetscCall(Text("-sets", &t->sets));
  PetscCall(Text("-material", &material));
  PetscCall(Text("-units", &t->units));
  PetscCall(Text("-name", &t->name));
  PetscCall(Text("-o", &t->output));
  PetscCall(Flag("-stress", &t->stress));
  PetscCall(Flag("-stiffening", &t->reduction.stiffening));
  PetscCall(Flag("-quiet", &t->quiet));
  const int doors = !t->mesh.empty() + !t->calculix.empty() + (!t->stiffness.empty() || !t->mass.empty());
  if (!doors) PetscFunctionReturn(0);
  t->kind = Task::ReduceModel;
  PetscCheck(doors == 1, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "-mesh, -calculix and -stiffness with -mass exclude each other: a model comes from one of them");
  PetscCheck(t->stiffness.empty() == t->mass.empty(), PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "-stiffness and -mass are needed together");
  PetscCheck((t->nodes.empty() && t->sets.empty()) || !t->stiffness.empty(), PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "-nodes and -sets belong to -stiffness and -mass");
  PetscCheck(t->stiffness.empty() || !t->nodes.empty(), PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "-nodes is missing: a reduction needs the coordinates of the nodes");
  PetscCheck(t->mesh.empty() == material.empty(), PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             t->mesh.empty() ? "-material belongs to -mesh: matrices have it inside" : "-material E,nu,rho is missing");
  if (!material.empty()) error = ParseMaterials(material, &t->materials);
  PetscCheck(error.empty(), PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT, "%s", error.c_str());
  PetscCheck(!t->output.empty(), PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "-o body.h5 is missing: where the reduced body shall go");
  PetscCall(ReadReduction(&t->reduction));
  PetscCheck(!t->stress || t->reduction.all_nodes, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "-stress needs the nodes, which -no_shapes leaves out");
  PetscCheck(!t->stress || t->stiffness.empty(), PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "-stress needs elements: with -mesh or -calculix");
  PetscCheck(!t->reduction.stiffening || t->stiffness.empty(), PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "-stiffening needs elements: with -mesh or -calculix");
  t->reduction.progress = !t->quiet;
  if (t->name.empty()) t->name = Stem(t->output);
  PetscFunctionReturn(0);
}

/* Refuses words that look like misspelled options of hhtreduce */
PetscErrorCode CheckSpelling()
{
  PetscInt    n;
  char      **name, **value;
  std::string wrong, meant;
  PetscFunctionBegin;
  PetscCall(PetscOptionsLeftGet(nullptr, &n, &name, &value));
  for (PetscInt i = 0; i < n && meant.empty(); i++)
    if ((meant = Meant(name[i])).size()) wrong = name[i];
  PetscCall(PetscOptionsLeftRestore(nullptr, &n, &name, &value));
  PetscCheck(meant.empty(), PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT, "there is no option -%s: is -%s meant?",
             wrong.c_str(), meant.c_str());
  PetscFunctionReturn(0);
}

} // namespace

Arguments::Arguments(int argc, char **argv)
{
  std::set<std::string> given;
  for (int i = 1; i < argc; i++)
    if (IsOption(argv[i])) given.insert(argv[i]);
  const bool model =
      given.count("-mesh") || given.count("-calculix") || given.count("-stiffness") || given.count("-vtu");
  help_alone = argc == 1 ||
               (given.size() == 1 && argc == 2 && (given.count("-help") || given.count("--help") || given.count("-h")));
  words.push_back(argv[0]);
  for (int i = 1; i < argc && !help_alone; i++) {
    std::string word  = argv[i];
    const bool  value = i + 1 < argc && !IsOption(argv[i + 1]);
    if (!IsOption(word)) {
      positional = word;
      words.push_back(word);
      continue;
    }
    /* PETSc has an option -info [file][:...] of its own, which would write into the body's file */
    if (word == "-info" && !model && value && argv[i + 1][0] != ':') word = "-body_info";
    words.push_back(word);
    if (value && !Contains(without_value, word.substr(1)))
      words.push_back(argv[++i]);
    else if (Contains(without_value, word.substr(1)) &&
             (!value || (std::strcmp(argv[i + 1], "0") && std::strcmp(argv[i + 1], "1") &&
                         std::strcmp(argv[i + 1], "true") && std::strcmp(argv[i + 1], "false"))))
      words.push_back("true"); /* otherwise PETSc would take the next word, the name of a file, for the option's value */
    else if (Contains(without_value, word.substr(1)))
      words.push_back(argv[++i]);
  }
}

PetscErrorCode ReadTask(const Arguments &arguments, Task *t)
{
  std::string info;
  bool        mode, trace;
  PetscBool   asked;
  PetscFunctionBegin;
  PetscCall(Flag("-traceback", &trace));
  PetscCall(Text("-body_info", &info));
  PetscCall(Text("-vtu", &t->vtu));
  PetscCall(Text("-body", &t->body));
  PetscCall(ReadModelOptions(t));
  if (t->body.empty()) t->body = arguments.positional;
  PetscCheck((t->kind == Task::ReduceModel) + !info.empty() + !t->vtu.empty() <= 1, PETSC_COMM_WORLD,
             PETSC_ERR_USER_INPUT, "a model to be reduced, -info and -vtu are tasks for a run each");
  if (!info.empty()) {
    t->kind = Task::Info;
    t->body = info;
  }
  if (!t->vtu.empty()) {
    t->kind = Task::Picture;
    PetscCall(Whole("-mode", &t->mode, &mode));
    PetscCall(Real("-scale", &t->scale, &t->scale_given));
    PetscCheck(mode, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT, "-vtu needs -mode k, the number of the mode from 0");
    PetscCheck(!t->body.empty(), PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
               "-vtu needs the file of the body, as in: hhtreduce -vtu mode3.vtu -mode 3 frame.h5");
  }
  PetscCall(CheckSpelling());
  PetscCheck(t->kind != Task::ReduceModel || arguments.positional.empty(), PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "\"%s\" belongs to no option; hhtreduce -help explains them", arguments.positional.c_str());
  PetscCall(PetscOptionsHasHelp(nullptr, &asked));
  if (asked && t->kind == Task::None) PetscFunctionReturn(0); /* PETSc has printed the help */
  PetscCheck(t->kind != Task::None, PETSC_COMM_WORLD, PETSC_ERR_USER_INPUT,
             "nothing to do: give a model (-mesh, -calculix, -stiffness and -mass), -info or -vtu; hhtreduce -help "
             "explains them");
  PetscFunctionReturn(0);
}

PetscErrorCode WarnOfUnused()
{
  PetscInt n;
  char   **name, **value;
  PetscFunctionBegin;
  PetscCall(PetscOptionsLeftGet(nullptr, &n, &name, &value));
  for (PetscInt i = 0; i < n; i++)
    PetscCall(PetscFPrintf(PETSC_COMM_WORLD, PETSC_STDERR,
                           "hhtreduce: option -%s was not used: misspelt, or without meaning here\n", name[i]));
  PetscCall(PetscOptionsLeftRestore(nullptr, &n, &name, &value));
  PetscFunctionReturn(0);
}

} // namespace hhtreduce
