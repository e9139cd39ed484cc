/* Results of all models: counts, distributions, a line for each failure; as text, CSV and a page */
#ifndef HHTDAE_SOAK_MODEL_REPORT_H
#define HHTDAE_SOAK_MODEL_REPORT_H

#include "bench/page.h"
#include "model_choice.h"
#include "model_pool.h"
#include <algorithm>

namespace soak
{

using hhtbench::Page;
using hhtbench::Text;

class Report
{
public:
  Report(long seed, const Choice &choice, int planned)
      : seed_(seed), choice_(choice), planned_(planned)
  {
  }

  void progress(const Outcome &o, int done)
  {
    if (o.verdict != Right) std::printf("%s\n", line(o).c_str());
    if (done % 100 == 0 && planned_ > 100) std::printf("soak: %d of %d models\n", done, planned_);
    std::fflush(stdout);
  }
  void add(const Outcome &o)
  {
    all_.push_back(o);
    countTypes(o);
  }

  int with(Verdict v) const
  {
    return (int)std::count_if(all_.begin(), all_.end(), [v](const Outcome &o) { return o.verdict == v; });
  }
  int by(By b) const
  {
    return (int)std::count_if(all_.begin(), all_.end(), [b](const Outcome &o) { return o.by == b; });
  }
  int  finished() const { return with(Right) + with(Wrong) + with(Unknown); }
  bool passed() const
  {
    return !with(Wrong) && with(Unknown) <= 1 + (int)all_.size() / 50 && !with(Crashed) && !with(Hung) && finished() >= 0.995 * (double)all_.size();
  }

  void print() const
  {
    std::printf("\n");
    for (const auto &r : counts()) std::printf("%-44s %s\n", r[0].c_str(), r[1].c_str());
    std::printf("\n%-36s %10s %10s %10s %10s %10s\n", "distribution", "least", "10 %", "median", "90 %", "most");
    for (const auto &r : distributions())
      std::printf("%-36s %10s %10s %10s %10s %10s\n", r[0].c_str(), r[1].c_str(), r[2].c_str(), r[3].c_str(),
                  r[4].c_str(), r[5].c_str());
    if (all_.size() == 1) std::printf("\n%s\n%s\n", describe(all_[0]).c_str(), all_[0].types);
    std::printf("\n%s\n", passed() ? "soak: passed" : "soak: FAILED");
  }

  PetscErrorCode write(const std::string &prefix) const
  {
    PetscFunctionBegin;
    PetscCall(writeTable(prefix + ".csv"));
    PetscCall(writePage(prefix + ".html", prefix + ".csv"));
    std::printf("%s.csv, %s.html\n", prefix.c_str(), prefix.c_str());
    PetscFunctionReturn(0);
  }

private:
  struct Use {
    int models = 0, instances = 0;
  };
  long                       seed_;
  Choice                     choice_;
  int                        planned_;
  std::vector<Outcome>       all_;
  std::map<std::string, Use> types_;

  void countTypes(const Outcome &o)
  {
    const std::string s = o.types;
    for (std::size_t at = 0; at < s.size();) {
      const std::size_t equal = s.find('=', at), end = s.find(';', at);
      if (equal == std::string::npos || end == std::string::npos) break;
      Use &u = types_[s.substr(at, equal - at)];
      u.models++;
      u.instances += std::atoi(s.c_str() + equal + 1);
      at = end + 1;
    }
  }

  std::string command(const Outcome &o) const
  {
    return Text("build/bin/models -seed %ld -first %ld -count 1%s", seed_, o.number, choice_.options().c_str());
  }
  std::string line(const Outcome &o) const
  {
    return Text("%s: %s | %s", verdict_name[o.verdict], o.message, command(o).c_str());
  }
  std::string describe(const Outcome &o) const
  {
    return Text("model %ld: %s (reference: %s, %d leg(s), %ld steps), %d bodies, t = %g, length %g, mass %g\n"
                "  error %.2e, at eps/10 %.2e, at eps/100 %.2e; references differ by %.2e; judged samples %d of %d "
                "(eps/100: %d); %.2f of what is allowed\n"
                "  velocity %.1e, %.1e; reaction %.1e, %.1e; %ld steps, %ld at eps/10, %ld failed corrections, %ld "
                "changes of axes; %.2f s in all\n"
                "  balance %.1e, between steps %.1e, residual %.1e, %d bodies not judged; run again %d, gone on %d\n  %s",
                o.number, verdict_name[o.verdict], by_name[o.by], o.legs, o.reference_steps, o.bodies, o.end, o.length,
                o.mass, o.error, o.finer, o.finest, o.doubt, o.window, samples, o.finest_window, o.used, o.velocity,
                o.finer_velocity, o.reaction, o.finer_reaction, o.steps, o.finer_steps, o.fails, o.changes, o.total,
                o.balance, o.between, o.unsolved, o.unjudged, o.repeated, o.resumed, o.message);
  }

  std::vector<Page::Row> counts() const
  {
    const auto             percent = [&](int n) { return Text("%d (%.2f %%)", n, 100. * n / (double)all_.size()); };
    std::vector<Page::Row> r;
    int whole = 0, finest = 0, part = 0, disturbed = 0, blow = 0, kept = 0, switched = 0, balanced = 0, repeated = 0, resumed = 0;
    for (const Outcome &o : all_) {
      switched += o.switched;
      balanced += o.balance >= 0 && o.balance <= allowed_imbalance;
      repeated += o.repeated;
      resumed += o.resumed;
      disturbed += o.verdict == Right && o.disturbed;
      blow += o.verdict == Right && o.blow;
      whole += o.verdict == Right && o.window == samples;
      finest += o.verdict == Right && o.window < samples && o.finest_window == samples;
      part += o.verdict == Right && o.window < samples && o.finest_window < samples;
      kept += o.by != ByNobody && o.conservative;
    }
    r.push_back({"models", std::to_string(all_.size())});
    r.push_back({"finished with default settings", percent(finished())});
    r.push_back({"right", percent(with(Right))});
    r.push_back({"  over the whole span at the default tolerance", percent(whole)});
    r.push_back({"  at eps/100 over the whole span", percent(finest)});
    r.push_back({"  over a part of it, chaotic beyond", percent(part)});
    r.push_back({"  of these, as far as a disturbance lets them be", percent(disturbed)});
    r.push_back({"  of these, from a first step in which nothing moves", percent(blow)});
    r.push_back({"wrong", percent(with(Wrong))});
    r.push_back({"failed with a message", percent(with(Failed))});
    r.push_back({"crashed", percent(with(Crashed))});
    r.push_back({"hung", percent(with(Hung))});
    r.push_back({"finished, without any reference", percent(with(Unknown))});
    r.push_back({"reference by SUNDIALS IDA", percent(by(ByIDA))});
    r.push_back({"reference by hhtdae, radius 0.8, 1e-7", percent(by(ByHHT))});
    r.push_back({"energy is kept, and checked", percent(kept)});
    r.push_back({"with stiff elements that let go or take hold", percent(switched)});
    r.push_back({"every body in balance by its channels", percent(balanced)});
    r.push_back({"described and run again, digit for digit", percent(repeated)});
    r.push_back({"gone on from a checkpoint, digit for digit", percent(resumed)});
    return r;
  }

  template <class F> Page::Row distribution(const std::string &what, const char *format, const F &f) const
  {
    std::vector<double> x;
    for (const Outcome &o : all_) {
      const double v = f(o);
      if (v >= 0 && std::isfinite(v)) x.push_back(v);
    }
    Page::Row row = {what};
    std::sort(x.begin(), x.end());
    for (double q : {0., 0.1, 0.5, 0.9, 1.})
      row.push_back(x.empty() ? "-" : Text(format, x[(std::size_t)(q * (double)(x.size() - 1))]));
    return row;
  }
  std::vector<Page::Row> distributions() const
  {
    const auto judged = [](const Outcome &o, double v) { return o.by == ByNobody ? -1 : v; };
    return {
        distribution("bodies", "%.0f", [](const Outcome &o) { return o.bodies; }),
        distribution("steps", "%.0f", [](const Outcome &o) { return o.steps ? (double)o.steps : -1; }),
        distribution("rejected per 100 steps", "%.1f",
                     [](const Outcome &o) { return o.steps ? 100. * (double)o.rejected / (double)o.steps : -1; }),
        distribution("iterations per step", "%.2f",
                     [](const Outcome &o) { return o.steps ? (double)o.newton / (double)o.steps : -1; }),
        distribution("factorizations per 100 steps", "%.1f",
                     [](const Outcome &o) { return o.steps ? 100. * (double)o.factorizations / (double)o.steps : -1; }),
        distribution("CPU time, s", "%.4f", [](const Outcome &o) { return o.steps ? o.cpu : -1; }),
        distribution("CPU time with references, s", "%.3f", [](const Outcome &o) { return o.total; }),
        distribution("error of positions", "%.1e", [&](const Outcome &o) { return judged(o, o.error); }),
        distribution("the same at a tenth of the tolerance", "%.1e",
                     [&](const Outcome &o) { return judged(o, o.finer); }),
        distribution("part of the error that is allowed", "%.1e", [&](const Outcome &o) { return judged(o, o.used); }),
        distribution("mean error of velocities", "%.1e", [&](const Outcome &o) { return judged(o, o.velocity); }),
        distribution("the same at a tenth of the tolerance", "%.1e",
                     [&](const Outcome &o) { return judged(o, o.finer_velocity); }),
        distribution("mean error of reactions", "%.1e", [&](const Outcome &o) { return judged(o, o.reaction); }),
        distribution("the same at a tenth of the tolerance", "%.1e",
                     [&](const Outcome &o) { return judged(o, o.finer_reaction); }),
        distribution("constraints are off by", "%.1e", [](const Outcome &o) { return o.misfit; }),
        distribution("velocity constraints, off by", "%.1e", [](const Outcome &o) { return o.slip; }),
        distribution("imbalance of bodies", "%.1e", [](const Outcome &o) { return o.balance; }),
        distribution("the same between steps", "%.1e", [](const Outcome &o) { return o.between; }),
        distribution("equations of motion not solved", "%.1e", [](const Outcome &o) { return o.unsolved; }),
        distribution("drift of the reference's energy", "%.1e", [](const Outcome &o) { return o.energy; }),
        distribution("part of the span judged, defaults", "%.2f",
                     [&](const Outcome &o) { return judged(o, (double)o.window / samples); }),
        distribution(
            "part judged, at eps/100 if need be", "%.2f",
            [&](const Outcome &o) { return judged(o, (double)std::max(o.window, o.finest_window) / samples); }),
        distribution("difference of the references", "%.1e", [&](const Outcome &o) { return judged(o, o.doubt); }),
        distribution("stiffest spring", "%.1e", [](const Outcome &o) { return o.stiffest > 0 ? o.stiffest : -1; }),
        distribution("scale of masses", "%.1e", [](const Outcome &o) { return o.mass; })};
  }

  PetscErrorCode writeTable(const std::string &file) const
  {
    PetscFunctionBegin;
    std::ofstream f(file);
    f << "number,verdict,reference,bodies,planar,end,length,mass,speed,stiffest,steps,rejected,newton,jacobians,"
         "factorizations,corrector_fails,changes,cpu,total,error,finer,finest,"
         "velocity,finer_velocity,reaction,finer_reaction,doubt,misfit,slip,energy,finest_window,disturbed,blow,window,used,"
         "legs,"
         "reference_steps,switched,balance,between,unsolved,unjudged,repeated,resumed,message,types\n";
    for (const Outcome &o : all_) {
      std::string message = o.message;
      std::replace(message.begin(), message.end(), '"', '\'');
      std::replace(message.begin(), message.end(), '\n', ' ');
      f << o.number << ',' << verdict_name[o.verdict] << ',' << by_name[o.by] << ',' << o.bodies << ',' << o.planar
        << ',' << o.end << ',' << o.length << ',' << o.mass << ',' << o.speed << ',' << o.stiffest << ',' << o.steps
        << ',' << o.rejected << ',' << o.newton << ',' << o.jacobians << ',' << o.factorizations << ',' << o.fails
        << ',' << o.changes << ',' << o.cpu << ',' << o.total << ',' << o.error << ',' << o.finer << ',' << o.finest
        << ',' << o.velocity << ',' << o.finer_velocity << ',' << o.reaction << ',' << o.finer_reaction << ','
        << o.doubt << ',' << o.misfit << ',' << o.slip << ',' << o.energy << ',' << o.finest_window << ','
        << o.disturbed << ',' << o.blow << ',' << o.window << ',' << o.used << ',' << o.legs << ',' << o.reference_steps << ','
        << o.switched << ',' << o.balance << ',' << o.between << ',' << o.unsolved << ',' << o.unjudged << ',' << o.repeated << ','
        << o.resumed << ",\"" << message << "\"," << o.types << '\n';
    }
    f.close();
    PetscCheck(f, PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE,
               "The table %s cannot be written; is there such a folder? -output names another", file.c_str());
    PetscFunctionReturn(0);
  }

  PetscErrorCode writePage(const std::string &file, const std::string &csv) const
  {
    Page page(Text("%d models", (int)all_.size()));
    PetscFunctionBegin;
    page.text("Scenes made at random, each run with default settings (tolerance 1e-4) and compared with SUNDIALS IDA "
              "on the stabilized first-order form of index 2. "
              "A run at tolerance eps is right where the error of positions, relative to max(1, size), is at most eps "
              "steps (10 + 3 growth): growth is the difference of "
              "two references at 1e-6 and 1e-7 in units of 1e-6. Where this exceeds 1, the same is asked of a run at "
              "eps/100. Models that a change of gravity, of places of bodies and points by eps N / 2 moves as far "
              "(a third of the error at least) are asked no further from there.");
    page.code(Text("build/bin/models -seed %ld -count %d%s", seed_, (int)all_.size(), choice_.options().c_str()));
    page.table({"outcome", "models"}, counts());
    page.table({"distribution", "least", "10 %", "median", "90 %", "most"}, distributions());
    std::vector<Page::Row> failures, types;
    for (const Outcome &o : all_)
      if (o.verdict != Right) failures.push_back({std::string(verdict_name[o.verdict]), o.message, command(o)});
    page.section("What was not right");
    if (failures.empty())
      page.text("Nothing.");
    else
      page.table({"verdict", "reason", "command"}, failures);
    page.section("Pictures");
    PetscCall(page.plot("set logscale xy\nset xlabel 'error allowed times part used: error at the default "
                        "tolerance'\nset ylabel 'error at a tenth of it'\nset datafile separator ','\nset key off\n"
                        "plot '" +
                            csv + "' every ::1 using 20:21 with points pt 7 ps 0.3, x with lines, x/4.6 with lines",
                        "Errors of positions at two tolerances; lines: equal, and what second order gives"));
    PetscCall(page.plot("set logscale xy\nset xlabel 'bodies'\nset ylabel 'CPU time, s'\nset datafile separator "
                        "','\nset key off\nplot '" +
                            csv + "' every ::1 using 4:18 with points pt 7 ps 0.3",
                        "CPU time of the run with defaults"));
    page.section("What the models are made of");
    for (const auto &t : types_)
      types.push_back({t.first, std::to_string(t.second.models), std::to_string(t.second.instances)});
    page.table({"type", "models", "instances"}, types);
    PetscCall(page.write(file));
    PetscFunctionReturn(0);
  }
};

} // namespace soak

#endif
