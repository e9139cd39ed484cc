/*
  Judgement of one model: the run with default settings (tolerance 1e-4), a run at a tenth of this tolerance, two
  references, and the verdict.

  Error of a position: |x - x_ref| / max(1, largest |x_ref| of that channel so far), with the weights of the method's
  error test.

  A run at tolerance eps is right if at every sample time t

    error(t) <= eps (N(t) + 50) (10 + 3 G(t)) + 3 t sqrt(eps n^(1/2) a / k) + 3 (t - t_c) min(2 v, eps n^(1/2) w),

  N: number of steps so far, each of which may leave an error of eps, and 50 for the start and impacts. G: growth of
  errors by the model itself, estimated by IDA: the difference of its runs at tolerances 10 eps_ref and eps_ref, over
  10 eps_ref.

  The second term is for elements that are released with an acceleration a (the weight; other loads increase it, hence the
  factor 3): a step h over this jump misses a velocity of up to a h, and the error test accepts
  h = sqrt(eps n^(1/2) / (k a)) (k of (26), 0.1; the n coordinates share one norm). The third term is for hard contacts of
  frequency w, reached at t_c with the speed v: the error test accepts h^3 = eps n^(1/2) / (k v w^2), and the method's
  damping takes about a tenth of (h w)^3 of the speed, or all of it where the depth v/w is below the tolerance.

  The formula is applied as long as its right-hand side is below 1; beyond, the tolerance does not determine the solution.
  If that happens before the end, a third run, at eps / 100, must be right by the same formula. If an error is larger,
  gravity, bodies and points are displaced by eps N / 2 in six directions: if that moves the model as far (at least a third
  as far), eps does not determine its solution from there on, since it is near a separatrix. A model that is right with a
  first step in which nothing moves has missed the impact of an element that stops it at the start: it is counted
  separately. If the error of the first run is above 1e-3, that of the second run must be smaller, or else that of the
  third; if neither is, the error of a run at eps / 1000 must be smaller than both the first and the third, or a sharper
  reference must be nearer to the run.

  In addition constraints must be satisfied to eps, and the reference must conserve the energy of a model without losses.

  Judgements that do not use the residual or a reference are in model_laws.h: the laws of Newton and Euler for every body;
  and, equal to the last digit, the model described and run again, and a checkpoint written half way and resumed.
*/
#ifndef HHTDAE_SOAK_MODEL_JUDGE_H
#define HHTDAE_SOAK_MODEL_JUDGE_H

#include "model_laws.h"
#include "model_outcome.h"
#include "model_reference.h"

namespace soak
{

class Judge
{
public:
  Judge(std::uint64_t seed, long number, const Choice &choice, bool again, bool laws, const std::vector<ReducedPart> &parts,
        bool options, Outcome *outcome)
      : seed_(seed), choice_(choice), again_(again), laws_(laws), options_(options), parts_(parts), o_(*outcome)
  {
    o_.number = number;
  }

  void run()
  {
    const double start = ProcessorSeconds();
    model_             = build();
    describe();
    Settings defaults;
    defaults.options   = options_;
    o_.stage           = Default;
    const Trajectory a = RunHHT(model_, defaults);
    costs(a);
    if (!a.arrived())
      fail(Failed, a.failure);
    else {
      judge(a);
      if (o_.verdict == Right || o_.verdict == Unknown) again(a);
    }
    o_.total = ProcessorSeconds() - start;
    o_.stage = Done;
  }

private:
  static constexpr double per_step = 10, per_growth = 3, undetermined = 1, reference_eps = 1e-7;
  static constexpr double no_motion   = 1e-14; /* length of the first step in periods */
  static constexpr double default_eps = 1e-4; /* default of PETSc and of the library */

  std::uint64_t                             seed_;
  Choice                                    choice_;
  bool                                      again_, laws_, options_;
  const std::vector<ReducedPart>           &parts_;
  Model                                     model_;
  Outcome                                  &o_;
  Trajectory                                looser_, reference_;
  std::map<double, std::vector<Trajectory>> disturbed_; /* by the size of the disturbance */
  bool                                      sharpened_[3] = {}; /* by the kind of reference */
  std::string                               moves_; /* how far the reference moved when it was sharpened, if it did */
  double finest_ = 0; /* error at the smallest tolerance at which the span of the default run was judged */

  Model build(const Vector3 &push = Vector3::Zero()) const
  {
    return Generator(seed_, (std::uint64_t)o_.number, choice_, parts_, push).make();
  }

  void fail(Verdict v, const std::string &why)
  {
    o_.verdict = v;
    SetText(o_.message, sizeof o_.message, why);
  }

  /* of a difference to the reference; not if the reference itself still moves */
  void complain(const std::string &what)
  {
    if (moves_.empty()) fail(Wrong, what);
    else fail(Unknown, moves_);
  }

  void describe()
  {
    o_.bodies   = model_.bodies;
    o_.planar   = model_.planar;
    o_.switched = model_.switched;
    o_.end      = model_.end;
    o_.length   = model_.length;
    o_.mass     = model_.mass;
    o_.speed    = model_.speed;
    o_.stiffest = model_.stiffest;
    o_.softest  = model_.softest;
    std::string all;
    for (const auto &t : model_.types) all += t.first + "=" + std::to_string(t.second) + ";";
    SetText(o_.types, sizeof o_.types, all);
  }
  void costs(const Trajectory &a)
  {
    o_.steps          = a.cost.steps;
    o_.rejected       = a.cost.rejected;
    o_.newton         = a.cost.newton;
    o_.jacobians      = a.cost.jacobians;
    o_.factorizations = a.cost.factorizations;
    o_.changes        = a.cost.changes;
    o_.fails          = a.cost.corrector_fails;
    o_.cpu            = a.cpu;
    o_.misfit         = a.misfit;
    o_.slip           = a.slip < 0 ? -1 : a.slip * model_.period / ((1 + model_.speed) * model_.length);
  }

  /* ---- judgements that do not depend on accuracy ---- */

  void laws()
  {
    o_.stage               = Laws;
    const Trajectory sharp = RunHHT(build(), LawSettings(patience(4)));
    o_.balance             = sharp.balance;
    o_.between             = sharp.between;
    o_.unsolved            = sharp.unsolved;
    o_.unjudged            = sharp.unjudged;
    if (!sharp.arrived() && !sharp.late) fail(Failed, "with a sharp corrector: " + sharp.failure);
    else if (sharp.balance > allowed_imbalance) fail(Wrong, "out of balance: " + sharp.out_of_balance);
    else if (sharp.unsolved > allowed_residual) fail(Wrong, "equations of motion not solved: " + sharp.where_unsolved);
  }
  void again(const Trajectory &a)
  {
    const int before       = o_.verdict;
    if (laws_) laws();
    if (o_.verdict == Wrong || o_.verdict == Failed) return;
    o_.verdict = before;
    if (!again_) return;
    o_.stage = Again;
    std::string    why;
    const Repeated r = Repeat([&] { return build(); }, a, options_, &why);
    o_.repeated      = r.again;
    o_.resumed       = r.resumed;
    if (!why.empty()) fail(Wrong, why);
  }

  /* ---- references ---- */

  double patience(double seconds) const { return (choice_.small ? 0.12 : 1) * seconds * work_per_second; }

  void refer()
  {
    o_.stage = Referring;
#ifdef HHTDAE_HAVE_IDA
    looser_ = RunIDA(build(), 10 * reference_eps, patience(3), &o_.legs);
    if (looser_.arrived()) reference_ = RunIDA(build(), reference_eps, patience(5), &o_.legs);
    if (looser_.arrived() && reference_.arrived())
      o_.by = ByIDA;
    else
      SetText(o_.message, sizeof o_.message, looser_.arrived() ? reference_.failure : looser_.failure);
#endif
    if (o_.by == ByNobody) referToItself();
    o_.reference_steps = reference_.steps;
  }

  /* Reference by hhtdae itself with another spectral radius, at two small tolerances */
  void referToItself()
  {
    Settings tight;
    tight.radius  = 0.8;
    tight.eps     = 10 * reference_eps;
    tight.work    = patience(5);
    looser_       = RunHHT(build(), tight);
    tight.eps     = reference_eps;
    tight.work    = patience(10);
    if (looser_.arrived()) reference_ = RunHHT(build(), tight);
    if (looser_.arrived() && reference_.arrived()) o_.by = ByHHT;
  }

  /* An invariant of the reference, if the model has one: energy, relative to the energy exchanged; it must be
     conserved to 1e-3 */
  bool keepsEnergy()
  {
    const std::size_t kinetic = model_.observed.size() - 2, potential = kinetic + 1;
    double            least = 1e300, most = -1e300, moved = 0;
    o_.conservative = model_.conservative;
    if (!model_.conservative) return true;
    for (const auto &x : reference_.x) {
      least = std::min(least, x[kinetic] + x[potential]);
      most  = std::max(most, x[kinetic] + x[potential]);
      moved = std::max(moved, x[kinetic]);
    }
    /* scale for models at rest, which have no energy to lose: a hundredth of a motion with the scales of the model */
    const double v = 0.01 * model_.length / model_.period;
    o_.energy      = (most - least) / std::max(moved, model_.mass * v * v);
    return o_.energy < 1e-3;
  }

  /* ---- differences ---- */

  double weight(std::size_t channel, int k) const
  {
    double w = 1;
    for (int l = 0; l <= k; l++) w = std::max(w, std::abs(reference_.x[(std::size_t)l][channel]));
    return w;
  }
  /* error of positions at sample k */
  double error(const Trajectory &a, int k) const
  {
    double worst = 0;
    for (std::size_t c = 0; c < model_.observed.size(); c++)
      if (model_.observed[c] == Observed::Position) {
        const double d = std::abs(a.x[(std::size_t)k][c] - reference_.x[(std::size_t)k][c]) / weight(c, k);
        if (!(d <= worst)) worst = d;
      }
    return worst;
  }
  double error(const Trajectory &a) const
  {
    double worst = 0;
    for (int k = 0; k < samples; k++) worst = std::max(worst, error(a, k));
    return worst;
  }
  /* error of velocities or reactions relative to the largest value of all; the mean over time, because they may jump */
  double meanError(const Trajectory &a, Observed kind) const
  {
    double largest = 0, sum = 0;
    for (std::size_t c = 0; c < model_.observed.size(); c++)
      for (int k = 0; k < samples; k++)
        if (model_.observed[c] == kind) largest = std::max(largest, std::abs(reference_.x[(std::size_t)k][c]));
    const double rate  = 1 / model_.period;
    const double least = 1e-3 * model_.length * rate * (kind == Observed::Velocity ? 1 : model_.mass * rate);
    for (int k = 0; k < samples && largest > least; k++) {
      double worst = 0;
      for (std::size_t c = 0; c < model_.observed.size(); c++)
        if (model_.observed[c] == kind)
          worst = std::max(worst, std::abs(a.x[(std::size_t)k][c] - reference_.x[(std::size_t)k][c]));
      sum += worst / largest / samples;
    }
    return largest > least ? sum : -1;
  }

  /* ---- verdict ---- */

  double allowed(double eps, const Trajectory &a, int k) const
  {
    const double t = SampleTime(model_.end, k + 1), after = std::max(0., t - model_.impact.time),
                 shared = eps * std::sqrt(6. * model_.bodies);
    double       doubt = 0;
    for (int l = 0; l <= k; l++) doubt = std::max(doubt, error(looser_, l));
    return eps * (double)(a.steps_at[(std::size_t)k] + 50) * (per_step + per_growth * doubt / (10 * reference_eps)) +
           3 * t * std::sqrt(shared / 0.1 * model_.jump) +
           3 * after * std::min(2 * model_.impact.speed, shared * model_.impact.frequency);
  }

  /* Number of samples at which the tolerance determines the solution; and whether all of these are right */
  int window(double eps, const Trajectory &a) const
  {
    int k = 0;
    while (k < samples && allowed(eps, a, k) < undetermined) k++;
    return k;
  }
  bool right(double eps, const Trajectory &a, const char *which)
  {
    const int n = window(eps, a);
    for (int k = 0; k < n; k++) {
      const double e = error(a, k), most = allowed(eps, a, k);
      o_.used = std::max(o_.used, e / most);
      if (e <= most) continue;
      if (sharpen(e)) return right(eps, a, which);
      if (e <= 3 * disturbance(0.5 * eps * (double)a.steps, k)) {
        o_.disturbed = 1;
        return true;
      }
      if (rightFromASmallStep(eps, n)) {
        o_.blow = 1;
        return true;
      }
      complain(hhtbench::Text("%s: error %.2e at t = %g, allowed %.2e", which, e, SampleTime(model_.end, k + 1), most));
      return false;
    }
    return true;
  }
  /* Whether the model is right with a first step in which nothing moves: then the impact at its start was missed */
  bool rightFromASmallStep(double eps, int n)
  {
    Settings small;
    small.eps          = eps;
    small.first        = no_motion * model_.period;
    o_.stage           = Finer;
    const Trajectory b = RunHHT(build(), small);
    o_.stage           = Judging;
    for (int k = 0; b.arrived() && k < n; k++)
      if (error(b, k) > allowed(eps, b, k)) return false;
    return b.arrived();
  }
  /* Displacement of the reference up to sample k if gravity, bodies and points are disturbed */
  double disturbance(double by, int k)
  {
    std::vector<Trajectory> &all = disturbed_[by];
    for (int d = 0; d < 6 && (int)all.size() < 6; d++) {
      const Vector3 push = (d % 2 ? -by : by) * Vector3::Unit(d / 2);
      all.push_back(referenceOf(push));
    }
    double most = 0;
    for (const Trajectory &t : all)
      for (int l = 0; l <= k && l < (int)t.x.size(); l++) most = std::max(most, error(t, l));
    return most;
  }
  Trajectory referenceOf(const Vector3 &push)
  {
#ifdef HHTDAE_HAVE_IDA
    int legs;
    if (o_.by == ByIDA) return RunIDA(build(push), 10 * reference_eps, patience(4), &legs);
#endif
    Settings tight;
    tight.radius  = 0.8;
    tight.eps     = 10 * reference_eps;
    tight.work    = patience(4);
    return RunHHT(build(push), tight);
  }

  double largest(const Trajectory &a, int n) const
  {
    double e = 0;
    for (int k = 0; k < n; k++) e = std::max(e, error(a, k));
    return e;
  }

  void judge(const Trajectory &a)
  {
    o_.stage = Finer;
    Settings finer;
    finer.eps          = 0.1 * default_eps;
    const Trajectory b = RunHHT(build(), finer);
    o_.finer_steps     = b.steps;
    if (!b.arrived()) return fail(Failed, "at a tenth of the tolerance: " + b.failure);
    refer();
    if (o_.by == ByNobody) return;
    if (!keepsEnergy()) {
      o_.verdict = Unknown;
      return SetText(o_.message, sizeof o_.message,
                     hhtbench::Text("the energy of the reference drifts by %.1e", o_.energy));
    }
    if (options_) converge();
    o_.stage          = Judging;
    o_.error          = error(a);
    o_.finer          = error(b);
    o_.velocity       = meanError(a, Observed::Velocity);
    o_.finer_velocity = meanError(b, Observed::Velocity);
    o_.reaction       = meanError(a, Observed::Reaction);
    o_.finer_reaction = meanError(b, Observed::Reaction);
    o_.doubt          = error(looser_);
    o_.window         = window(default_eps, a);
    o_.verdict        = Right;
    if (!(a.misfit <= default_eps * std::max(1., model_.length)))
      return fail(Wrong, hhtbench::Text("constraints are off by %.2e", a.misfit));
    if (!right(default_eps, a, "defaults") || !right(finer.eps, b, "a tenth of the tolerance")) return;
    const double first = largest(a, o_.window), second = largest(b, o_.window);
    const bool   falls = o_.disturbed || o_.blow || first < 1e-3 || second < 0.7 * first;
    if (o_.window == samples && falls) return;
    finest();
    if (o_.verdict == Right && !falls && !(finest_ < 0.7 * first)) stillFalls(first, second);
  }

  /* Before a model is called wrong its reference is sharpened, once for each kind. A reference that still moves by a
     tenth of the difference in question proves nothing against a model. IDA's matrix may be older than the release of
     a brake, and IDA then does not notice the release: its iteration is continued to a smaller tolerance. If IDA's
     reference cannot be sharpened at all, hhtdae's own takes its place, with a first step in which nothing moves:
     where a damper stops a moving body at the start and joints have friction, the impact on them depends on details in
     time that no tolerance of positions resolves */
  bool sharpen(double complaint)
  {
    const By   by      = (By)o_.by;
    const bool could   = !sharpened_[by];
    Trajectory sharper = could ? sharperReference() : Trajectory();
    sharpened_[by]     = true;
    o_.stage           = Judging;
    if (!could || (!sharper.arrived() && by == ByHHT)) return false;
    if (!sharper.arrived()) return judgeByItself();
    const double differ = error(looser_);
    std::swap(reference_, sharper);
    const double moved = error(sharper);
    const bool   less  = by == ByIDA && moved <= 0.3 * differ; /* compared with the change over the power of ten before */
    if (!less && moved > 0.1 * complaint) moves_ = hhtbench::Text("the reference moves by %.1e with its %s", moved, by == ByIDA ? "tolerance" : "first step");
    return true;
  }
  Trajectory sharperReference()
  {
    o_.stage = Referring;
#ifdef HHTDAE_HAVE_IDA
    for (double factor : {0.001, 0.01, 0.03, 0.1, 0.3}) {
      if (o_.by != ByIDA) break;
      Trajectory t = RunIDA(build(), factor * reference_eps, patience(10), &o_.legs, 1e-5);
      if (t.arrived() || factor > 0.2) return t;
    }
#endif
    Settings tight;
    tight.radius  = 0.8;
    tight.eps     = reference_eps;
    tight.work    = patience(10);
    tight.first   = no_motion * model_.period;
    return RunHHT(build(), tight);
  }
  bool judgeByItself()
  {
    Trajectory looser = looser_, reference = reference_;
    o_.by = ByNobody;
    referToItself();
    o_.stage = Judging;
    if (o_.by == ByHHT) return true;
    o_.by = ByIDA;
    std::swap(looser_, looser);
    std::swap(reference_, reference);
    return false;
  }
  /* Times of impacts and stops scatter, so that errors of neighbouring tolerances may be in reverse order; a
     thousandth of the tolerance decides */
  void stillFalls(double first, double second)
  {
    Settings s;
    s.eps              = 1e-3 * default_eps;
    o_.stage           = Finer;
    const Trajectory d = RunHHT(build(), s);
    if (!d.arrived()) return fail(Failed, "at a thousandth of the tolerance: " + d.failure);
    o_.stage          = Judging;
    const double last = largest(d, o_.window);
    if ((last < 0.7 * first && last < 0.7 * finest_) || (sharpen(last) && largest(d, o_.window) < 0.3 * last)) return;
    complain(hhtbench::Text("the error does not fall with the tolerance: %.2e, then %.2e, %.2e and %.2e", first, second, finest_, last));
  }

  /* For a model that is run alone: errors over tolerances, for both kinds of damping */
  void converge()
  {
    for (double eps = default_eps; eps > 2e-9; eps *= 0.1)
      for (int other = 0; other < 2; other++) {
        Settings s;
        s.eps                 = eps;
        s.radius              = other ? 0.8 : -1;
        s.work                = 60 * work_per_second;
        const char      *what = other ? "radius 0.8" : "alpha -0.3";
        const Trajectory t    = RunHHT(build(), s);
        if (!t.arrived())
          std::printf("eps %.0e, %s: %s\n", eps, what, t.failure.c_str());
        else {
          std::printf("eps %.0e, %s: %6ld steps, error %.2e, half way %.2e, allowed %.2e\n", eps, what, t.steps,
                      error(t), error(t, samples / 2), allowed(eps, t, samples - 1));
        }
      }
  }

  void finest()
  {
    Settings s;
    s.eps              = 0.01 * default_eps;
    o_.stage           = Finer;
    const Trajectory c = RunHHT(build(), s);
    if (!c.arrived()) return fail(Failed, "at a hundredth of the tolerance: " + c.failure);
    o_.stage         = Judging;
    o_.finest        = error(c);
    o_.finest_window = window(s.eps, c);
    finest_          = largest(c, o_.window);
    right(s.eps, c, "a hundredth of the tolerance");
  }
};

} // namespace soak

#endif
