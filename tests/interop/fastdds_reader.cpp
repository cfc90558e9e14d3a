// Reads topics with Fast DDS, a second vendor's middleware, and prints one message of each as JSON.
//
// Usage: fastdds_reader DOMAIN SECONDS TOPIC=PACKAGE/NAME...
//
// TOPIC is a ROS name (/sovo/odom). Types: nav_msgs/Odometry, sensor_msgs/CameraInfo and
// sensor_msgs/Image. Exit codes: 0 all were read, 1 some were not.

#include <fastcdr/Cdr.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>

#include <array>
#include <chrono>
#include <cstdlib>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

namespace {

namespace fast = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;
using Bytes = std::vector<char>;
using Json = nlohmann::json;
using eprosima::fastcdr::Cdr;

/// A type of which the middleware knows only the name: messages stay as they came.
class SerializedType : public fast::TopicDataType {
 public:
  explicit SerializedType(const std::string& name) {
    setName(name.c_str());
    m_typeSize = 1 << 24;
    m_isGetKeyDefined = false;
    auto_fill_type_object(false);
    auto_fill_type_information(false);
  }
  bool serialize(void* /*data*/, rtps::SerializedPayload_t* /*payload*/) override { return false; }
  bool deserialize(rtps::SerializedPayload_t* payload, void* data) override {
    static_cast<Bytes*>(data)->assign(payload->data, payload->data + payload->length);
    return true;
  }
  std::function<std::uint32_t()> getSerializedSizeProvider(void* data) override {
    return [data] { return static_cast<std::uint32_t>(static_cast<Bytes*>(data)->size()); };
  }
  void* createData() override { return new Bytes(); }
  void deleteData(void* data) override { delete static_cast<Bytes*>(data); }
  bool getKey(void* /*data*/, rtps::InstanceHandle_t* /*handle*/, bool /*md5*/) override {
    return false;
  }
};

template <class T>
T read(Cdr& cdr) {
  T value{};
  cdr >> value;
  return value;
}

template <class T, std::size_t N>
Json read_array(Cdr& cdr) {
  std::array<T, N> values{};
  cdr >> values;
  return values;
}

Json read_header(Cdr& cdr) {
  Json stamp;
  stamp["sec"] = read<std::int32_t>(cdr);
  stamp["nanosec"] = read<std::uint32_t>(cdr);
  return {{"stamp", stamp}, {"frame_id", read<std::string>(cdr)}};
}

Json read_odometry(Cdr& cdr) {
  Json message = {{"header", read_header(cdr)}};
  message["child_frame_id"] = read<std::string>(cdr);
  Json& pose = message["pose"]["pose"];
  for (const char* axis : {"x", "y", "z"}) pose["position"][axis] = read<double>(cdr);
  for (const char* axis : {"x", "y", "z", "w"}) pose["orientation"][axis] = read<double>(cdr);
  message["pose"]["covariance"] = read_array<double, 36>(cdr);
  Json& twist = message["twist"]["twist"];
  for (const char* kind : {"linear", "angular"}) {
    for (const char* axis : {"x", "y", "z"}) twist[kind][axis] = read<double>(cdr);
  }
  message["twist"]["covariance"] = read_array<double, 36>(cdr);
  return message;
}

Json read_camera_info(Cdr& cdr) {
  Json message = {{"header", read_header(cdr)}};
  message["height"] = read<std::uint32_t>(cdr);
  message["width"] = read<std::uint32_t>(cdr);
  message["distortion_model"] = read<std::string>(cdr);
  message["d"] = read<std::vector<double>>(cdr);
  message["k"] = read_array<double, 9>(cdr);
  message["r"] = read_array<double, 9>(cdr);
  message["p"] = read_array<double, 12>(cdr);
  return message;
}

Json read_image(Cdr& cdr) {
  Json message = {{"header", read_header(cdr)}};
  message["height"] = read<std::uint32_t>(cdr);
  message["width"] = read<std::uint32_t>(cdr);
  message["encoding"] = read<std::string>(cdr);
  message["is_bigendian"] = read<std::uint8_t>(cdr);
  message["step"] = read<std::uint32_t>(cdr);
  message["data"] = read<std::vector<std::uint8_t>>(cdr);
  return message;
}

struct KnownType {
  const char* ros_name;
  const char* dds_name;
  Json (*read)(Cdr& cdr);
};

constexpr KnownType kTypes[] = {
    {"nav_msgs/Odometry", "nav_msgs::msg::dds_::Odometry_", read_odometry},
    {"sensor_msgs/CameraInfo", "sensor_msgs::msg::dds_::CameraInfo_", read_camera_info},
    {"sensor_msgs/Image", "sensor_msgs::msg::dds_::Image_", read_image},
};

struct Wanted {
  std::string topic;
  const KnownType* type = nullptr;
  fast::DataReader* reader = nullptr;
  bool done = false;
};

fast::DomainParticipant* open_participant(unsigned domain) {
  fast::DomainParticipantQos qos;
  auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  udp->interfaceWhiteList.emplace_back("127.0.0.1");
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports.push_back(udp);
  return fast::DomainParticipantFactory::get_instance()->create_participant(domain, qos);
}

bool subscribe(fast::DomainParticipant* participant, fast::Subscriber* subscriber, Wanted* wanted) {
  const fast::TypeSupport type(new SerializedType(wanted->type->dds_name));
  type.register_type(participant);
  fast::Topic* topic = participant->create_topic("rt" + wanted->topic, wanted->type->dds_name,
                                                 fast::TOPIC_QOS_DEFAULT);
  if (topic == nullptr) return false;
  fast::DataReaderQos qos;
  qos.reliability().kind = fast::RELIABLE_RELIABILITY_QOS;
  qos.history().depth = 1;
  // Memory grows with what comes; the largest message is not allocated beforehand.
  qos.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  wanted->reader = subscriber->create_datareader(topic, qos);
  return wanted->reader != nullptr;
}

/// Prints the next message, when there is one.
void take(Wanted* wanted) {
  Bytes bytes;
  fast::SampleInfo info;
  if (wanted->reader->take_next_sample(&bytes, &info) != ReturnCode_t::RETCODE_OK) return;
  if (!info.valid_data) return;
  eprosima::fastcdr::FastBuffer buffer(bytes.data(), bytes.size());
  Cdr cdr(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
  cdr.read_encapsulation();
  const Json line = {{"topic", wanted->topic},
                     {"dds_type", wanted->type->dds_name},
                     {"message", wanted->type->read(cdr)}};
  std::cout << line.dump() << std::endl;
  wanted->done = true;
}

bool parse(const std::string& text, Wanted* wanted) {
  const auto equals = text.find('=');
  if (equals == std::string::npos) return false;
  wanted->topic = text.substr(0, equals);
  for (const KnownType& type : kTypes) {
    if (text.substr(equals + 1) == type.ros_name) wanted->type = &type;
  }
  return wanted->type != nullptr;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) return 1;
  fast::DomainParticipant* participant =
      open_participant(static_cast<unsigned>(std::strtoul(argv[1], nullptr, 10)));
  if (participant == nullptr) return 1;
  fast::Subscriber* subscriber = participant->create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT);
  std::vector<Wanted> all(static_cast<std::size_t>(argc) - 3);
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (parse(argv[i + 3], &all[i]) && subscribe(participant, subscriber, &all[i])) continue;
    std::cerr << "cannot subscribe to " << argv[i + 3] << "\n";
    return 1;
  }
  const auto end =
      std::chrono::steady_clock::now() + std::chrono::seconds(std::strtol(argv[2], nullptr, 10));
  std::size_t done = 0;
  while (done < all.size() && std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    done = 0;
    for (Wanted& wanted : all) {
      if (!wanted.done) take(&wanted);
      done += wanted.done ? 1U : 0U;
    }
  }
  for (const Wanted& wanted : all) {
    if (!wanted.done) std::cerr << "nothing could be read from " << wanted.topic << "\n";
  }
  participant->delete_contained_entities();
  fast::DomainParticipantFactory::get_instance()->delete_participant(participant);
  return done == all.size() ? 0 : 1;
}
