/* Functions of hhtdae/hhtdae.h on petsc4py's TS: settings, results, statistics. */
#include "bind.h"
#include "hhtdae/hhtdae.h"

namespace hhtdae
{
namespace python
{

namespace
{

/* The index of a name in one of PETSc's lists of names of an enumeration; an error that lists the names if it is not among them */
int Choice(const char *const *names, int count, const std::string &given, const char *what)
{
  std::string known;
  for (int k = 0; k < count; k++) {
    if (given == names[k]) return k;
    known += (k ? ", " : "") + std::string(names[k]);
  }
  throw py::value_error(std::string(what) + " is '" + given + "', must be one of " + known);
}

TSHHT3Role Role(const std::string &name) { return (TSHHT3Role)Choice(TSHHT3Roles, TSHHT3_NUM_ROLES, name, "role"); }

py::dict Statistics(py::object ts)
{
  TSHHT3Statistics s;
  Check(TSHHT3GetStatistics(ToTS(ts), &s));
  using py::literals::operator""_a;
  return py::dict("steps"_a = s.steps, "rejected"_a = s.rejected, "newton"_a = s.newton, "residuals"_a = s.residuals, "jacobians"_a = s.jacobians,
                  "factorizations"_a = s.factorizations, "solves"_a = s.solves, "time"_a = s.time, "cpu"_a = s.cpu, "corrector_fails"_a = s.corrector_fails,
                  "retries"_a = s.retries, "restarts"_a = s.restarts, "changes"_a = s.changes, "tiny_steps"_a = s.tiny_steps,
                  "h_min"_a = s.h_min, "h_max"_a = s.h_max, "of_order"_a = py::make_tuple(s.of_order[2], s.of_order[3], s.of_order[4], s.of_order[5]));
}

/* (U, U', U'') at time t as new vectors; at: TSHHT3Interpolate() or TSHHT3EvaluateAt() */
py::tuple StateAt(py::object ts, double t, PetscErrorCode (*at)(TS, PetscReal, Vec, Vec, Vec))
{
  Vec U, X[3];
  Check(TS2GetSolution(ToTS(ts), &U, &X[0]));
  py::object x[3];
  for (int k = 0; k < 3; k++) {
    Check(VecDuplicate(U, &X[k]));
    x[k] = FromVec(X[k]);
    Check(PetscObjectDereference((PetscObject)X[k])); /* x[k] owns the vector */
  }
  Check(at(ToTS(ts), t, X[0], X[1], X[2]));
  return py::make_tuple(x[0], x[1], x[2]);
}

/* The message and number of the first rank that has failed, on all ranks; None if none has failed. Collective. */
py::object FirstFailure(py::object of, const std::string &mine)
{
  const MPI_Comm comm = ToComm(of);
  PetscMPIInt    size, rank, failed, first, length = (PetscMPIInt)mine.size();
  MPI_Comm_size(comm, &size);
  MPI_Comm_rank(comm, &rank);
  failed = mine.empty() ? size : rank;
  MPI_Allreduce(&failed, &first, 1, MPI_INT, MPI_MIN, comm);
  if (first == size) return py::none();
  MPI_Bcast(&length, 1, MPI_INT, first, comm);
  std::string text = mine;
  text.resize(length);
  MPI_Bcast(&text[0], length, MPI_CHAR, first, comm);
  return py::make_tuple((int)first, text);
}

/* TSAdaptSetStepLimits(), since petsc4py does not wrap TSAdapt */
void SetMaxStep(py::object ts, double h)
{
  TSAdapt adapt;
  Check(TSGetAdapt(ToTS(ts), &adapt));
  Check(TSAdaptSetStepLimits(adapt, PETSC_DEFAULT, h));
}

} // namespace

void BindIntegrator(py::module_ &m)
{
  m.def("initialize", [] { Check(TSHHT3Initialize()); });
  m.def("set_form", [](py::object ts, const std::string &form) {
    if (form != "paper" && form != "second_order") throw py::value_error("form is '" + form + "', must be 'paper' or 'second_order'");
    Check(TSHHT3SetForm(ToTS(ts), form == "paper" ? TSHHT3_FORM_PAPER : TSHHT3_FORM_SECOND_ORDER));
  });
  m.def("get_form", [](py::object ts) {
    TSHHT3Form form = TSHHT3_FORM_PAPER;
    Check(TSHHT3GetForm(ToTS(ts), &form));
    return form == TSHHT3_FORM_PAPER ? "paper" : "second_order";
  });
  m.def("set_alpha", [](py::object ts, double alpha) { Check(TSHHT3SetAlpha(ToTS(ts), alpha)); });
  m.def("get_alpha", [](py::object ts) {
    PetscReal alpha = 0;
    Check(TSHHT3GetAlpha(ToTS(ts), &alpha));
    return (double)alpha;
  });
  m.def("set_radius", [](py::object ts, double radius) { Check(TSHHT3SetRadius(ToTS(ts), radius)); });
  m.def("set_order", [](py::object ts, PetscInt order) { Check(TSHHT3SetOrder(ToTS(ts), order ? order : TSHHT3_ORDER_AUTO)); });
  m.def("get_order", [](py::object ts) {
    PetscInt order = 2;
    Check(TSHHT3GetOrder(ToTS(ts), &order));
    return order == TSHHT3_ORDER_AUTO ? 0 : order;
  });
  m.def("set_corrector_tolerance", [](py::object ts, double c) { Check(TSHHT3SetCorrectorTolerance(ToTS(ts), c)); });
  m.def("set_predictor_degree", [](py::object ts, PetscInt degree) { Check(TSHHT3SetPredictorDegree(ToTS(ts), degree)); });
  m.def("set_reuse", [](py::object ts, double slow, double low, double high) { Check(TSHHT3SetReuse(ToTS(ts), slow, low, high)); });
  m.def("set_is", [](py::object ts, const std::string &role, py::object is) { Check(TSHHT3SetIS(ToTS(ts), Role(role), ToIS(is))); });
  m.def("get_is", [](py::object ts, const std::string &role) {
    IS is = nullptr;
    Check(TSHHT3GetIS(ToTS(ts), Role(role), &is));
    return is ? FromIS(is) : py::none();
  });
  m.def("set_nodes", [](py::object ts, py::object nodes, py::object reference) {
    Check(TSHHT3SetNodes(ToTS(ts), nodes.is_none() ? nullptr : ToIS(nodes), reference.is_none() ? nullptr : ToVec(reference)));
  });
  m.def("set_start", [](py::object ts, const std::string &start) {
    Check(TSHHT3SetStart(ToTS(ts), (TSHHT3Start)Choice(TSHHT3Starts, 3, start, "start")));
  });
  m.def("get_acceleration", [](py::object ts) {
    Vec A = nullptr;
    Check(TSHHT3GetAcceleration(ToTS(ts), &A));
    return FromVec(A);
  });
  m.def("interpolate", [](py::object ts, double t) { return StateAt(ts, t, TSHHT3Interpolate); });
  m.def("set_max_step", SetMaxStep);
  m.def("evaluate_at", [](py::object ts, double t) { return StateAt(ts, t, TSHHT3EvaluateAt); });
  m.def("statistics", Statistics);
  m.def("option_used", [](const std::string &name) {
    PetscBool used = PETSC_FALSE;
    Check(PetscOptionsUsed(nullptr, name.c_str(), &used));
    return used == PETSC_TRUE;
  });
  m.def("first_failure", FirstFailure);
  m.def("abort", [](int code) {
    int over;
    MPI_Finalized(&over);
    if (!over) MPI_Abort(MPI_COMM_WORLD, code);
  });
  m.def("checkpoint_save", [](py::object ts, const std::string &file) { Check(TSHHT3CheckpointSave(ToTS(ts), file.c_str())); });
  m.def("set_from_options", [](py::object ts) { Check(TSSetFromOptions(ToTS(ts))); });
  m.def("set_up", [](py::object ts) { Check(TSSetUp(ToTS(ts))); });
  m.def("checkpoint_load", [](py::object ts, const std::string &file) { Check(TSHHT3CheckpointLoad(ToTS(ts), file.c_str())); });
  m.def("set_checkpoint_vec", [](py::object ts, py::object x) { Check(TSHHT3SetCheckpointVec(ToTS(ts), x.is_none() ? nullptr : ToVec(x))); });
}

} // namespace python
} // namespace hhtdae
