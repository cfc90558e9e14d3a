#include "sovo/bridge/participant.h"

#include "sovo/bridge/dds_security.h"
#include "sovo/bridge/ros_graph.h"
#include "sovo/bridge/ros_names.h"
#include "sovo/bridge/shared_memory.h"

namespace sovo::bridge {
namespace {

Result<DdsHandle> open_domain(const NetworkPlan& plan, const std::string& network) {
  const dds_entity_t domain = dds_create_domain(plan.domain, plan.xml.c_str());
  // Another participant of this process has opened it: its settings hold.
  if (domain == DDS_RETCODE_PRECONDITION_NOT_MET) return DdsHandle();
  if (domain < 0) {
    return Error{"DDS domain " + std::to_string(plan.domain) + " cannot be opened (" +
                 dds_strretcode(domain) + "): is '" + network +
                 "' an interface or address of this machine that is up, and CYCLONEDDS_URI, if "
                 "set, a valid configuration?"};
  }
  return DdsHandle(domain);
}

}  // namespace

Participant::Participant(Participant&&) noexcept = default;
Participant& Participant::operator=(Participant&&) noexcept = default;
Participant::~Participant() = default;

Result<Participant> Participant::open(const DdsConfig& config, const std::string& node,
                                      const DdsEnvironment& environment) {
  auto plan = plan_network(config, environment);
  if (!plan) return plan.failure();
  if (auto planned = plan_shared_memory(config, node, &*plan); !planned) return planned.failure();
  const QosPtr qos(dds_create_qos());
  if (!config.security.empty()) {
    if (auto secured = secure(config.security, qos.get()); !secured) return secured.failure();
    plan->secured = true;
    plan->notes.push_back("DDS Security with the keys in " + config.security +
                          ": nothing is exchanged with those who have none");
  }
  auto domain = open_domain(*plan, config.network);
  if (!domain) return domain.failure();

  const std::string enclave = "enclave=/;";
  dds_qset_userdata(qos.get(), enclave.data(), enclave.size());
  auto entity = take_entity(dds_create_participant(plan->domain, qos.get(), nullptr),
                            "cannot create a DDS participant on network '" + config.network + "'" +
                                (plan->secured ? " with the keys in " + config.security : ""));
  if (!entity) return entity.failure();

  Participant result;
  result.config_ = config;
  result.plan_ = std::move(*plan);
  result.domain_ = std::move(*domain);
  result.participant_ = std::move(*entity);
  if (config.ros.graph != RosGraph::kOff) {
    auto graph = RosGraphWriter::open(result.entity(), config.ros.graph, "/" + config.ns, node);
    if (!graph) return graph.failure();
    result.graph_ = std::move(*graph);
  }
  return result;
}

std::string Participant::topic(const std::string& name) const {
  return ros_topic(config_.ns, name);
}

std::string Participant::frame(const std::string& name) const {
  return frame_name(config_.ns, name);
}

void Participant::announce() const {
  if (graph_) graph_->publish();
}

}  // namespace sovo::bridge
