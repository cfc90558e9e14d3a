#include <iomanip>
#include <locale>
#include <numbers>
#include <sstream>

#include "sovo/eval/evaluation.h"
#include "sovo/io/text.h"

namespace sovo {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;

/// A line of cells, each right-aligned in its width.
void write_row(std::ostream& out, const std::string& name, const std::vector<std::string>& cells) {
  out << "  " << std::left << std::setw(14) << name << std::right;
  for (const std::string& cell : cells) out << std::setw(12) << cell;
  out << "\n";
}

void write_segments(std::ostream& out, const EvaluationReport& r) {
  out << "Relative error (KITTI devkit, every " << r.step
      << ". frame a start; t in %, r in deg/100 m)\n";
  if (r.segments.empty()) {
    out << "  no piece of the path is that long\n\n";
    return;
  }
  write_row(out, "length [m]", {"pieces", "t mean", "t RMS", "t at scale*", "r mean", "r RMS"});
  const auto row = [&](const std::string& name, const SegmentSummary& s) {
    write_row(
        out, name,
        {std::to_string(s.count), format_fixed(100 * s.translation_mean, 4),
         format_fixed(100 * s.translation_rms, 4), format_fixed(100 * s.translation_best_mean, 4),
         format_fixed(100 * kDegrees * s.rotation_mean, 4),
         format_fixed(100 * kDegrees * s.rotation_rms, 4)});
  };
  for (const SegmentSummary& s : r.by_length) row(format_double(s.length), s);
  row("all", r.overall);
  out << "  * each piece at its own best scale: what is left is not scale\n\n";
}

void write_absolute(std::ostream& out, const EvaluationReport& r) {
  out << "Absolute error\n";
  write_row(out, "aligned by", {"RMSE", "mean", "median", "p95", "max", "scale"});
  const auto row = [&](const std::string& name, const Statistics& s, const std::string& scale) {
    write_row(out, name,
              {format_fixed(s.rmse, 4), format_fixed(s.mean, 4), format_fixed(s.median, 4),
               format_fixed(s.p95, 4), format_fixed(s.max, 4), scale});
  };
  const double scale = r.similarity.S_truth_estimate.scale();
  row("SE(3) [m]", r.rigid.translation, "1");
  row("yaw* [m]", r.yaw.translation, "1");
  row("Sim(3) [m]", r.similarity.translation, format_fixed(scale, 5));
  Statistics degrees = r.rotation;
  for (double* v : {&degrees.rmse, &degrees.mean, &degrees.median, &degrees.p95, &degrees.max}) {
    *v *= kDegrees;
  }
  row("rotation [deg]", degrees, "");
  out << "  * for estimates whose z axis is vertical; sovo's have the axes of the first camera\n\n";
}

void write_scale(std::ostream& out, const EvaluationReport& r) {
  out << "Scale error ln(true / estimated) over displacements of " << format_double(r.scale_length)
      << " m, from every " << (r.at_keyframes ? "keyframe" : "pose") << "\n";
  if (r.scale.count == 0) {
    out << "  the truth never moves that far\n";
  } else {
    write_row(out, "", {"count", "median |.|", "p95 |.|", "bias", "per 100 m"});
    write_row(out, "[%]",
              {std::to_string(r.scale.count), format_fixed(100 * r.scale.median_abs, 3),
               format_fixed(100 * r.scale.p95_abs, 3), format_fixed(100 * r.scale.bias, 3),
               format_fixed(100 * r.scale.drift_per_100m, 3)});
  }
  if (!r.at_keyframes) return;
  out << "  scale optimizations:";
  for (const auto& [verdict, count] : r.verdicts) out << " " << verdict << " " << count << ",";
  out << " median sigma " << format_fixed(100 * r.median_sigma, 3) << " %\n";
}

}  // namespace

std::string format_table(const EvaluationReport& r) {
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out << "Compared " << r.compared << " poses over " << format_fixed(r.path_length, 2) << " m and "
      << format_fixed(r.duration_s, 2) << " s; stamps differ by at most "
      << format_fixed(1e3 * r.worst_stamp_gap_s, 3) << " ms\n";
  out << "Completion " << format_fixed(100 * r.completion, 2) << " % of " << r.expected << " "
      << r.expected_is << "\n";
  for (const std::string& note : r.notes) out << "Note: " << note << "\n";
  out << "\n";
  write_segments(out, r);
  write_absolute(out, r);
  write_scale(out, r);
  return out.str();
}

}  // namespace sovo
