#include "sovo/bridge/topic_qos.h"

namespace sovo::bridge {
namespace {

// At DDS's default of 100 ms Cyclone leaves the parameter out of discovery, and some readers of
// other vendors then refuse the writer.
constexpr dds_duration_t kMaxBlockingTime = DDS_MSECS(33);

QosPtr common_qos(const TopicQos& qos, const std::string& type_hash) {
  QosPtr result(dds_create_qos());
  dds_qset_reliability(result.get(),
                       qos.best_effort ? DDS_RELIABILITY_BEST_EFFORT : DDS_RELIABILITY_RELIABLE,
                       kMaxBlockingTime);
  dds_qset_durability(result.get(),
                      qos.latched ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  dds_qset_history(result.get(), DDS_HISTORY_KEEP_LAST, qos.depth);
  // ROS 2 reads and writes XCDR1 only.
  const dds_data_representation_id_t xcdr1 = DDS_DATA_REPRESENTATION_XCDR1;
  dds_qset_data_representation(result.get(), 1, &xcdr1);
  const std::string user_data = "typehash=" + type_hash + ";";
  dds_qset_userdata(result.get(), user_data.data(), user_data.size());
  return result;
}

}  // namespace

QosPtr reader_qos(const TopicQos& qos, const std::string& type_hash) {
  return common_qos(qos, type_hash);
}

QosPtr writer_qos(const TopicQos& qos, const std::string& type_hash) {
  QosPtr result = common_qos(qos, type_hash);
  dds_qset_writer_data_lifecycle(result.get(), false);
  if (qos.latched) {
    dds_qset_durability_service(result.get(), 0, DDS_HISTORY_KEEP_LAST, qos.depth,
                                DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED);
  }
  return result;
}

}  // namespace sovo::bridge
