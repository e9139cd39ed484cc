/* The report on the all-terrain vehicle: runs, their costs and results, as one HTML page */
#ifndef HHTDAE_BENCH_ATV_PAGE_H
#define HHTDAE_BENCH_ATV_PAGE_H

#include "atv_runs.h"
#include "page.h"

namespace hhtbench
{

/* Everything that the page shows */
struct AtvResults {
  AtvRun              reference, check; /* check: the reference with twice its step */
  std::vector<AtvRun> main; /* hhtdae in both forms and IDA as GSTIFF, each with the largest step of the paper */
  std::vector<double> step; /* step sizes at which condition numbers were computed */
  std::vector<hhtstab::Conditions>  condition;
  std::vector<AtvRun>               sweep; /* runs over tolerances and largest steps, by name of the method */
  int                               jobs = 1; /* number of these runs at the same time */
  std::vector<HotSpot>              spots; /* of the reference */
  std::vector<std::vector<HotSpot>> found; /* of the main runs */
};

class AtvPage
{
public:
  /* scene: file of the page with the animated vehicle */
  AtvPage(const AtvResults &results, const hhtex::Atv &atv, const ReducedBody &body, const AtvStress &stress, const std::string &scene)
      : r_(results), atv_(atv), body_(body), stress_(stress), scene_(scene),
        page_("An all-terrain vehicle with a flexible frame: hhtdae and BDF")
  {
  }

  PetscErrorCode write(const std::string &file)
  {
    PetscFunctionBegin;
    PetscCall(model());
    cost();
    hotSpots();
    PetscCall(channel("Vertical reaction in the ball joint of the rear suspension", "reaction [N]", atv_.reaction.id));
    PetscCall(channel("Pitch rate of the engine", "pitch rate [rad/s]", atv_.pitch_rate.id));
    if (!r_.sweep.empty()) PetscCall(precision());
    conditions();
    PetscCall(page_.write(file));
    PetscFunctionReturn(0);
  }

private:
  const AtvResults  &r_;
  const hhtex::Atv  &atv_;
  const ReducedBody &body_;
  const AtvStress   &stress_;
  std::string        scene_;
  Page               page_;

  static std::string title(const AtvRun &run) { return run.name; }
  static std::string percent(double x) { return std::isnan(x) ? "-" : Text("%.3g %%", 100 * x); }

  PetscErrorCode model()
  {
    PetscFunctionBegin;
    page_.section("The model");
    page_.text(Text("%d moving parts, %d joints, %d motions on four shaker posts; the frame of welded tubes, a "
                    "finite-element model of %d nodes and "
                    "%d unknowns, is reduced to %d modes from %.1f Hz to %.1f kHz (20 attachments, 20 fixed-interface "
                    "normal modes). 2 s, output every "
                    "4 ms, largest step 0.5 ms. After the experiment of Negrut, Rampalli, Ottarsson and Sajdak, whose "
                    "frame had 134 modes from 56.7 Hz "
                    "to 13.1 kHz; dimensions and masses are in examples/atv_model.h and atv_frame.h.",
                    (int)atv_.parts, (int)atv_.joints, (int)atv_.motions, (int)body_.fe_nodes,
                    (int)(3 * body_.fe_nodes), (int)body_.modal.modes(), body_.modal.omega[0] / (2 * PETSC_PI),
                    body_.modal.omega[body_.modal.modes() - 1] / (2e3 * PETSC_PI)));
    page_.table({"unknowns", "here", "published"},
                {{"hhtdae", std::to_string(r_.main[0].equations), "532"},
                 {"BDF, first order, index 3", std::to_string(r_.main.back().equations), "927"}});
    page_.text("An attachment of the frame has no unknowns: what acts on it acts on the floating frame and the modes.");
#if defined(HHTDAE_PAGE)
    PetscCall(page_.frame(scene_, "The vehicle in motion: press play, drag to turn, click a part; colours are the von Mises stress of the frame"));
#else
    page_.text("The vehicle in motion is left out: the library was built without three.js or zlib (Debian: libjs-three, zlib1g-dev).");
#endif
    PetscFunctionReturn(0);
  }

  void cost()
  {
    std::vector<Page::Row> rows;
    const double           hht = r_.main[0].cpu;
    page_.section("What it costs");
    page_.text("These runs in one process, one after the other, on one core; CPU time of the solve alone, median of "
               "three: channels every 4 ms, for which hhtdae solves for accelerations and reactions between its steps, cost it as much again, and are "
               "taken in other runs. The published CPU times are "
               "122.47 s for HHT and 367.08 s for GSTIFF, a ratio of 3.0. IDA stands for GSTIFF here: BDF of variable "
               "order up to 5 on the index-3 form "
               "with velocities as unknowns, velocities and multipliers out of the error test, modal coordinates at a tenth of the "
               "tolerance of the attachments that they move, its matrix factored by "
               "KLU. Errors are largest "
               "differences from the reference as parts of the largest value.");
    for (const AtvRun &run : r_.main) rows.push_back(row(run, hht));
    page_.table(head(), rows);
    page_.text(Text("The reference: hhtdae, tolerance %.0e, steps of at most %.3g s, %ld steps. At twice the step "
                    "it differs from itself by %s of the "
                    "pitch rate and %s of the reaction.",
                    r_.reference.eps, r_.reference.step_max, r_.reference.count.steps,
                    percent(Difference(r_.check, r_.reference, atv_.pitch_rate.id)).c_str(),
                    percent(Difference(r_.check, r_.reference, atv_.reaction.id)).c_str()));
  }

  static Page::Row head()
  {
    return {"integrator",
            "tolerance",
            "largest step",
            "CPU s",
            "ratio",
            "steps",
            "iterations",
            "Jacobians",
            "factorizations",
            "error of pitch rate",
            "error of reaction"};
  }
  Page::Row row(const AtvRun &run, double unit) const
  {
    const std::string name = run.failure.empty() ? run.name : "!" + run.name + ": " + run.failure;
    return {name,
            Text("%.0e", run.eps),
            run.step_max > 0 ? Text("%.0e", run.step_max) : "none",
            Text("%.2f", run.cpu),
            Text("%.2f", run.cpu / unit),
            std::to_string(run.count.steps),
            std::to_string(run.count.newton),
            std::to_string(run.count.jacobians),
            std::to_string(run.count.factorizations),
            percent(Difference(run, r_.reference, atv_.pitch_rate.id)),
            percent(Difference(run, r_.reference, atv_.reaction.id))};
  }

  void hotSpots()
  {
    std::vector<Page::Row> rows;
    Page::Row              head = {"node", "x, y, z [m]", "reference [MPa]", "time [s]"};
    page_.section("The ten hot spots of the frame");
    for (const AtvRun &run : r_.main) {
      head.push_back(run.name + " [MPa]");
      head.push_back("time [s]");
      head.push_back("difference");
    }
    for (const HotSpot &s : r_.spots) {
      Page::Row row = {std::to_string(s.label), Text("%.3f, %.3f, %.3f", s.position(0), s.position(1), s.position(2)),
                       Text("%.3f", 1e-6 * s.stress), Text("%.3f", s.time)};
      for (const AtvRun &run : r_.main) {
        const NodeStress n = stress_.at(run, s.label);
        row.push_back(Text("%.3f", 1e-6 * n.stress));
        row.push_back(Text("%.3f", n.time));
        row.push_back(percent(std::fabs(n.stress / s.stress - 1)));
      }
      rows.push_back(row);
    }
    page_.table(head, rows, "Largest von Mises stress through the run, one place within 5 cm");
    for (size_t k = 0; k < r_.main.size(); k++)
      page_.text(
          Text("%s: %d of these ten nodes are among its own ten.", r_.main[k].name.c_str(), (int)common(r_.found[k])));
    page_.text("Published: the same ten nodes, the same times, differences below 0.5 % between HHT and GSTIFF.");
  }

  long common(const std::vector<HotSpot> &list) const
  {
    return std::count_if(list.begin(), list.end(), [&](const HotSpot &s) {
      return std::any_of(r_.spots.begin(), r_.spots.end(), [&](const HotSpot &t) { return t.label == s.label; });
    });
  }

  PetscErrorCode channel(const std::string &name, const std::string &axis, PetscInt id)
  {
    PetscFunctionBegin;
    std::vector<const AtvRun *> runs = {&r_.reference};
    std::string                 g, d;
    for (const AtvRun &run : r_.main)
      if (run.failure.empty()) runs.push_back(&run);
    page_.section(name);
    g = "set xlabel 'time [s]'\nset ylabel '" + axis + "'\nset grid\nset key outside top horizontal\nplot ";
    d = "set xlabel 'time [s]'\nset ylabel 'difference of " + axis +
        "'\nset grid\nset key outside top horizontal\nplot ";
    static const char *const colour[] = {"#000000", "#d00000", "#ff8c00", "#0060c0", "#909090"};
    for (size_t k = 0; k < runs.size(); k++) {
      const std::string style = Text("'-' using 1:2 with lines lc rgb '%s' lw %s title \"%s\"", colour[k % 5],
                                     k ? "1" : "2", runs[k]->name.c_str());
      g += (k ? ", " : "") + style;
      if (k) d += (k > 1 ? ", " : "") + style;
    }
    g += "\n";
    d += "\n";
    for (size_t k = 0; k < runs.size(); k++) {
      for (size_t i = 0; i < runs[k]->x.size() && i < r_.reference.x.size(); i++) {
        g += Text("%.4f %.8g\n", runs[k]->time[i], runs[k]->x[i][(size_t)id]);
        if (k) d += Text("%.4f %.8g\n", runs[k]->time[i], runs[k]->x[i][(size_t)id] - r_.reference.x[i][(size_t)id]);
      }
      g += "e\n";
      if (k) d += "e\n";
    }
    PetscCall(page_.plot(g, name));
    PetscCall(page_.plot(d, name + ": differences from the reference", 900, 360));
    for (const AtvRun *run : runs)
      if (run != &r_.reference)
        page_.text(run->name + ": largest difference from the reference " +
                   percent(Difference(*run, r_.reference, id)) + " of its largest value.");
    PetscFunctionReturn(0);
  }

  PetscErrorCode precision()
  {
    std::vector<Page::Row> rows;
    PetscFunctionBegin;
    page_.section("Error against run time");
    PetscCall(page_.plot(precisionPlot("pitch rate", atv_.pitch_rate.id),
                         "Error of the engine's pitch rate against CPU time: below and left is better", 900, 520));
    PetscCall(page_.plot(precisionPlot("reaction", atv_.reaction.id),
                         "Error of the reaction in the ball joint against CPU time", 900, 520));
    for (const AtvRun &run : r_.sweep) rows.push_back(row(run, r_.main[0].cpu));
    page_.table(head(), rows, "All runs; the ratio is to the first line of the first table");
    if (r_.jobs > 1) page_.text(Text("These runs went %d at a time, each in a process of its own, so that CPU times are less exact than those above.", r_.jobs));
    page_.text("Times of IDA are without those evaluations of the Jacobian that only our adapter makes, which takes "
               "the gradient of the "
               "constraints and the parts by velocity and acceleration from PETSc's one matrix.");
    page_.table({"error at most", "of", "hhtdae, fastest", "IDA, index 3, fastest", "ratio", "IDA, any form", "ratio"},
                equalErrors(), "Fastest of these runs with no larger error, CPU s");
    PetscFunctionReturn(0);
  }

  void conditions()
  {
    std::vector<Page::Row> rows;
    page_.section("Conditioning of the Newton matrix");
    page_.text(
        "Condition numbers (2-norm) in the three scalings that the paper weighs: (a) positions as unknowns, (b) "
        "accelerations as unknowns, (c) "
        "accelerations as unknowns and the position constraints over beta h^2, which is what hhtdae solves with.");
    for (size_t k = 0; k < r_.step.size(); k++)
      rows.push_back({Text("%.0e", r_.step[k]), Text("%.1e", r_.condition[k].a), Text("%.1e", r_.condition[k].b),
                      Text("%.1e", r_.condition[k].c)});
    page_.table({"h [s]", "(a)", "(b)", "(c)"}, rows);
  }

  std::vector<Page::Row> equalErrors() const
  {
    std::vector<Page::Row> rows;
    for (const auto &[what, id] :
         {std::make_pair("pitch rate", atv_.pitch_rate.id), std::make_pair("reaction", atv_.reaction.id)})
      for (double error : {5e-2, 1e-2, 1e-3, 2e-4}) {
        const double ours = fastest("hhtdae", id, error), gstiff = fastest("IDA, index 3", id, error),
                     any = fastest("IDA", id, error);
        rows.push_back({percent(error), what, seconds(ours), seconds(gstiff), seconds(gstiff / ours), seconds(any),
                        seconds(any / ours)});
      }
    return rows;
  }
  static std::string seconds(double x) { return std::isfinite(x) ? Text("%.2f", x) : "none"; }

  /* CPU time of the fastest run, among methods whose names begin with `method`, whose error is at most `error`;
     infinite if there is none */
  double fastest(const std::string &method, PetscInt id, double error) const
  {
    double best = PETSC_INFINITY;
    for (const AtvRun &run : r_.sweep)
      if (run.name.compare(0, method.size(), method) == 0 && Difference(run, r_.reference, id) <= error)
        best = std::min(best, run.cpu);
    return best < 1e300 ? best : std::numeric_limits<double>::infinity();
  }

  std::string precisionPlot(const std::string &what, PetscInt id) const
  {
    std::vector<std::string> methods;
    for (const AtvRun &run : r_.sweep)
      if (std::find(methods.begin(), methods.end(), run.name) == methods.end()) methods.push_back(run.name);
    std::string g = "set logscale xy\nset format x '10^{%L}'\nset xlabel 'error of the " + what +
                    ", part of its largest value'\nset ylabel 'CPU time [s]'\nset grid\nset key outside top horizontal "
                    "maxcols 2\nplot ";
    static const char *const colour[] = {"#d00000", "#ff8c00", "#a00060", "#0060c0", "#00a0c0", "#008060", "#909090"};
    for (size_t m = 0; m < methods.size(); m++)
      g += Text("%s'-' using 1:2 with linespoints lc rgb '%s' pt %d title \"%s\"", m ? ", " : "", colour[m % 7],
                (int)(m % 7 + 4), methods[m].c_str());
    g += "\n";
    for (const std::string &m : methods) {
      g += "NaN NaN\n";
      for (const AtvRun &run : r_.sweep) {
        const double e = Difference(run, r_.reference, id);
        if (run.name == m && e > 0 && e < 2) g += Text("%.4e %.4f\n", e, run.cpu);
      }
      g += "e\n";
    }
    return g;
  }
};

} // namespace hhtbench

#endif
