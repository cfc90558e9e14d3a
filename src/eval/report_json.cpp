#include <nlohmann/json.hpp>

#include "sovo/eval/evaluation.h"

namespace sovo {
namespace {

using Json = nlohmann::ordered_json;

Json to_json(const Statistics& s) {
  return {{"count", s.count},   {"rmse", s.rmse}, {"mean", s.mean},
          {"median", s.median}, {"p95", s.p95},   {"max", s.max}};
}

Json to_json(const SegmentSummary& s) {
  Json json;
  if (s.length > 0.0) json["length_m"] = s.length;
  json["count"] = s.count;
  json["t_rel_mean"] = s.translation_mean;
  json["t_rel_rms"] = s.translation_rms;
  json["t_rel_best_scale_mean"] = s.translation_best_mean;
  json["r_rel_mean_rad_per_m"] = s.rotation_mean;
  json["r_rel_rms_rad_per_m"] = s.rotation_rms;
  return json;
}

Json relative_error(const EvaluationReport& r) {
  Json json;
  json["lengths_m"] = r.lengths;
  json["step"] = r.step;
  json["all"] = to_json(r.overall);
  json["by_length"] = Json::array();
  for (const SegmentSummary& s : r.by_length) json["by_length"].push_back(to_json(s));
  return json;
}

Json scale_error(const EvaluationReport& r) {
  Json json;
  json["length_m"] = r.scale_length;
  json["starts"] = r.at_keyframes ? "keyframes" : "poses";
  json["count"] = r.scale.count;
  json["median_abs_log"] = r.scale.median_abs;
  json["p95_abs_log"] = r.scale.p95_abs;
  json["median_log"] = r.scale.bias;
  json["drift_log_per_100m"] = r.scale.drift_per_100m;
  if (r.at_keyframes) {
    json["verdicts"] = r.verdicts;
    json["median_sigma"] = r.median_sigma;
  }
  return json;
}

}  // namespace

std::string format_json(const EvaluationReport& r) {
  Json json;
  json["poses"] = {
      {"truth", r.truth_poses}, {"estimate", r.estimate_poses}, {"compared", r.compared}};
  json["completion"] = {
      {"value", r.completion}, {"expected", r.expected}, {"expected_is", r.expected_is}};
  json["worst_stamp_gap_s"] = r.worst_stamp_gap_s;
  json["duration_s"] = r.duration_s;
  json["path_length_m"] = r.path_length;
  json["relative"] = relative_error(r);
  json["ate_se3_m"] = to_json(r.rigid.translation);
  json["ate_yaw_m"] = to_json(r.yaw.translation);
  json["ate_sim3_m"] = to_json(r.similarity.translation);
  json["ate_sim3_m"]["scale"] = r.similarity.S_truth_estimate.scale();
  json["rotation_rad"] = to_json(r.rotation);
  json["scale"] = scale_error(r);
  json["notes"] = r.notes;
  return json.dump(2) + "\n";
}

}  // namespace sovo
