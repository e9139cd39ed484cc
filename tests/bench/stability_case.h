/*
  A case of the table of stability: a model, the quantity by which it is judged, and the figure that it must not exceed. A
  case that cannot succeed states words that its PETSc error must contain instead; the last accepted state is then judged as
  well, if its exact values are known.

    cases.push_back({"springs", "k=1e9", "position against the rigid rod", 2e-3, [](Run &run) -> PetscErrorCode { ...
  }});

  The program `stability` runs all cases; the fast ones are also tests in tests/stability/test_extreme.cpp.
*/
#ifndef HHTDAE_BENCH_STABILITY_CASE_H
#define HHTDAE_BENCH_STABILITY_CASE_H

#include <hhtdae/hhtdae.h>

#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <functional>
#include <string>
#include <vector>

namespace hhtstab
{

/* Plain data, because it is sent through a pipe by the process that runs the case */
struct Outcome {
  double           figure       = -1;    /* largest so far; NaN is kept */
  bool             finished     = false; /* the run reached its end time */
  int              code         = 0;     /* PETSc's error code; -1: the process crashed; -2: deadline */
  double           t            = 0;     /* time at which the run stopped */
  double           seconds      = 0;     /* of CPU time, including references */
  TSHHT3Statistics s            = {};
  char             message[400] = "", note[240] = "";
};

class Run
{
public:
  Outcome   &out;
  TSHHT3Form form;

  Run(Outcome &o, TSHHT3Form f) : out(o), form(f) {}

  void judge(double figure)
  {
    if (!(std::fabs(figure) <= out.figure)) out.figure = std::isnan(out.figure) ? out.figure : std::fabs(figure);
  }
  void note(const char *format, ...)
  {
    va_list arguments;
    va_start(arguments, format);
    std::vsnprintf(out.note, sizeof out.note, format, arguments);
    va_end(arguments);
  }

  /* Sets form, tolerance and options of a TS whose end time has been set */
  PetscErrorCode prepare(TS ts, double tolerance) const
  {
    PetscFunctionBegin;
    PetscCall(TSSetMaxSteps(ts, 100000000));
    PetscCall(TSSetTolerances(ts, tolerance, nullptr, tolerance, nullptr));
    PetscCall(TSHHT3SetForm(ts, form));
    PetscCall(TSSetFromOptions(ts));
    PetscFunctionReturn(0);
  }
  /* Selects steps of constant length */
  static PetscErrorCode fixSteps(TS ts, double h)
  {
    TSAdapt adapt;
    PetscFunctionBegin;
    PetscCall(TSGetAdapt(ts, &adapt));
    PetscCall(TSAdaptSetType(adapt, TSADAPTNONE));
    PetscCall(TSSetTimeStep(ts, h));
    PetscFunctionReturn(0);
  }
  /* Stores the counters whether or not the run succeeds. NaN or infinity in the final state makes the figure NaN */
  PetscErrorCode solve(TS ts, const std::function<PetscErrorCode()> &solver = {})
  {
    TSConvergedReason reason;
    PetscReal         t, norm[2];
    Vec               U, V;
    PetscFunctionBegin;
    const PetscErrorCode code = solver ? solver() : TSSolve(ts, nullptr);
    PetscCall(TSHHT3GetStatistics(ts, &out.s));
    PetscCall(TSGetTime(ts, &t));
    PetscCall(TSGetConvergedReason(ts, &reason));
    PetscCall(TS2GetSolution(ts, &U, &V));
    PetscCall(VecNorm(U, NORM_2, &norm[0]));
    PetscCall(VecNorm(V, NORM_2, &norm[1]));
    out.t        = t;
    out.finished = !code && reason == TS_CONVERGED_TIME;
    if (!code && !out.finished && !out.note[0]) note("ended with %s", TSConvergedReasons[reason]);
    if (!std::isfinite(norm[0] + norm[1])) judge(NAN);
    PetscFunctionReturn(code);
  }
};

struct Case {
  std::string kind, name, measure;
  double      accept; /* largest figure accepted; the same in both forms unless paper() sets another */
  std::function<PetscErrorCode(Run &)> run;
  std::string                          message = ""; /* words of the error that must end the run; empty: the run must finish */
  bool                                 may_finish = false; /* the run may also finish with the figure instead of this error */
  double                               deadline   = 20;    /* seconds */
  double accept_paper = -1;    /* for the paper's form, which is of first order where M varies; negative: as accept */
  bool   quick        = false; /* also a unit test */

  Case &mustFail(const std::string &words)
  {
    message = words;
    return *this;
  }
  /* Both are accepted: the end of the run with the figure, or this error */
  Case &orFail(const std::string &words)
  {
    message    = words;
    may_finish = true;
    return *this;
  }
  Case &paper(double figure)
  {
    accept_paper = figure;
    return *this;
  }
  Case &within(double seconds)
  {
    deadline = seconds;
    return *this;
  }
  Case &test()
  {
    quick = true;
    return *this;
  }
  double acceptance(TSHHT3Form form) const
  {
    return form == TSHHT3_FORM_PAPER && accept_paper >= 0 ? accept_paper : accept;
  }
  bool passed(TSHHT3Form form, const Outcome &o) const
  {
    const bool judged = o.figure <= acceptance(form); /* false for NaN */
    if (message.empty() || (may_finish && !o.code)) return o.finished && o.figure >= 0 && judged;
    return o.code > 0 && std::strstr(o.message, message.c_str()) && judged;
  }
};

using Cases = std::vector<Case>;

/* Adds a case and returns it for further settings */
inline Case &Add(Cases &cases, const std::string &kind, const std::string &name, const std::string &measure,
                 double accept, std::function<PetscErrorCode(Run &)> run)
{
  Case c{kind, name, measure, accept, std::move(run)};
  cases.push_back(std::move(c));
  return cases.back();
}

/* Error handler that keeps the first message of an error as the result and prints nothing */
inline PetscErrorCode KeepMessage(MPI_Comm, int, const char *, const char *, PetscErrorCode code, PetscErrorType type,
                                  const char *message, void *ctx)
{
  if (type == PETSC_ERROR_INITIAL && message)
    std::snprintf(static_cast<Outcome *>(ctx)->message, sizeof(Outcome::message), "%s", message);
  return code;
}

/* Suppresses the library's output, which belongs to the case, not to the terminal */
inline PetscErrorCode Silent(FILE *, const char[], va_list) { return 0; }

inline void RunCase(const Case &c, TSHHT3Form form, Outcome &out)
{
  Run           run(out, form);
  auto          print = PetscVFPrintf;
  const clock_t start = clock();
  PetscBool     show  = PETSC_FALSE;
  PetscOptionsHasName(nullptr, nullptr, "-show", &show);
  if (!show) PetscVFPrintf = Silent;
  PetscPushErrorHandler(KeepMessage, &out);
  out.code = (int)c.run(run);
  PetscPopErrorHandler();
  PetscVFPrintf = print;
  out.seconds   = (double)(clock() - start) / CLOCKS_PER_SEC;
}

/* The error that a tolerance permits. A linear oscillator whose steps follow from the error test has a global error of
   0.55 eps^(2/3) per radian of its motion (alpha = -0.3, h from k h^3 times the third derivative = eps). Mechanisms
   are allowed 20 times as much, because their frequency depends on the amplitude, so that phases drift */
inline double Allowed(double eps, double way) { return 11 * std::pow(eps, 2. / 3) * way; }

/* The paper's form where M varies: its error, of first order, is of the size of h, which is proportional to eps^(1/3) */
inline double AllowedFirstOrder(double eps, double way) { return std::pow(eps, 1. / 3) * way; }

/* Error control locates a jump of the acceleration by a to within h = sqrt(eps/(k a)), k = 0.1; this is the resulting
   error of the velocity */
inline double AllowedJump(double eps, double a) { return std::sqrt(eps * a / 0.1); }

inline std::string Name(const char *format, double x)
{
  char s[64];
  std::snprintf(s, sizeof s, format, x);
  return s;
}

} // namespace hhtstab

#endif
