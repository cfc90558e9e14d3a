#include "sovo/bridge/cdr_sertype.h"

#include <dds/ddsc/dds_public_impl.h>
#include <dds/ddsi/q_radmin.h>
#include <dds/ddsrt/heap.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <limits>
#include <memory>
#include <new>

namespace sovo::bridge {
namespace {

constexpr std::size_t kHeaderSize = 4;  // of the encapsulation

/// Cyclone DDS may ask for bytes up to the next multiple of 4.
constexpr std::size_t padded(std::size_t size) { return (size + 3) / 4 * 4; }

struct CdrSerdata : ddsi_serdata {
  std::uint32_t size = 0;
  std::unique_ptr<std::uint8_t[]> data;
};

const CdrSerdata& cdr(const ddsi_serdata* serdata) {
  return *static_cast<const CdrSerdata*>(serdata);
}

/// Bytes of `size` to be filled in; null when there is no memory or no message can have that size.
CdrSerdata* new_serdata(const ddsi_sertype* type, ddsi_serdata_kind kind, std::size_t size) {
  if (kind == SDK_DATA && size < kHeaderSize) return nullptr;
  if (size > std::numeric_limits<std::uint32_t>::max() - kHeaderSize) return nullptr;
  try {
    auto serdata = std::make_unique<CdrSerdata>();
    ddsi_serdata_init(serdata.get(), type, kind);
    // Without keys there is one instance, which all samples hash to.
    serdata->hash = type->serdata_basehash;
    serdata->size = static_cast<std::uint32_t>(size);
    serdata->data = std::make_unique_for_overwrite<std::uint8_t[]>(padded(size));
    std::fill(serdata->data.get() + size, serdata->data.get() + padded(size), 0);
    return serdata.release();
  } catch (const std::bad_alloc&) {
    return nullptr;
  }
}

bool eqkey(const ddsi_serdata*, const ddsi_serdata*) { return true; }

std::uint32_t get_size(const ddsi_serdata* serdata) { return cdr(serdata).size; }

ddsi_serdata* from_ser(const ddsi_sertype* type, ddsi_serdata_kind kind, const nn_rdata* fragment,
                       size_t size) {
  if (kind != SDK_DATA) return new_serdata(type, kind, 0);
  CdrSerdata* serdata = new_serdata(type, kind, size);
  if (serdata == nullptr) return nullptr;
  std::size_t have = 0;
  for (; fragment != nullptr; fragment = fragment->nextfrag) {
    const std::size_t end = std::min<std::size_t>(fragment->maxp1, size);
    if (fragment->min > have || end <= have) continue;  // fragments may overlap
    const unsigned char* payload =
        NN_RMSG_PAYLOADOFF(fragment->rmsg, NN_RDATA_PAYLOAD_OFF(fragment));
    std::memcpy(serdata->data.get() + have, payload + (have - fragment->min), end - have);
    have = end;
  }
  if (have == size) return serdata;
  delete serdata;
  return nullptr;
}

ddsi_serdata* from_ser_iov(const ddsi_sertype* type, ddsi_serdata_kind kind,
                           ddsrt_msg_iovlen_t count, const ddsrt_iovec_t* parts, size_t size) {
  if (kind != SDK_DATA) return new_serdata(type, kind, 0);
  CdrSerdata* serdata = new_serdata(type, kind, size);
  if (serdata == nullptr) return nullptr;
  std::size_t have = 0;
  for (ddsrt_msg_iovlen_t i = 0; i < count && have < size; ++i) {
    const std::size_t part = std::min<std::size_t>(parts[i].iov_len, size - have);
    std::memcpy(serdata->data.get() + have, parts[i].iov_base, part);
    have += part;
  }
  if (have == size) return serdata;
  delete serdata;
  return nullptr;
}

ddsi_serdata* from_keyhash(const ddsi_sertype* type, const ddsi_keyhash*) {
  return new_serdata(type, SDK_KEY, 0);
}

ddsi_serdata* from_sample(const ddsi_sertype* type, ddsi_serdata_kind kind, const void* sample) {
  if (kind != SDK_DATA) return new_serdata(type, kind, 0);
  const CdrBytes bytes = static_cast<const CdrView*>(sample)->bytes;
  CdrSerdata* serdata = new_serdata(type, kind, bytes.size());
  if (serdata != nullptr) std::copy(bytes.begin(), bytes.end(), serdata->data.get());
  return serdata;
}

void to_ser(const ddsi_serdata* serdata, size_t offset, size_t size, void* buffer) {
  std::memcpy(buffer, cdr(serdata).data.get() + offset, size);
}

ddsi_serdata* to_ser_ref(const ddsi_serdata* serdata, size_t offset, size_t size,
                         ddsrt_iovec_t* part) {
  part->iov_base = cdr(serdata).data.get() + offset;
  part->iov_len = static_cast<ddsrt_iov_len_t>(size);
  return ddsi_serdata_ref(serdata);
}

void to_ser_unref(ddsi_serdata* serdata, const ddsrt_iovec_t*) { ddsi_serdata_unref(serdata); }

/// Samples are taken as bytes (dds_takecdr) only.
bool to_sample(const ddsi_serdata*, void*, void**, void*) { return false; }

bool untyped_to_sample(const ddsi_sertype*, const ddsi_serdata*, void*, void**, void*) {
  return false;
}

ddsi_serdata* to_untyped(const ddsi_serdata* serdata) {
  CdrSerdata* untyped = new_serdata(serdata->type, SDK_KEY, 0);
  if (untyped != nullptr) untyped->type = nullptr;
  return untyped;
}

void free_serdata(ddsi_serdata* serdata) { delete static_cast<CdrSerdata*>(serdata); }

size_t print(const ddsi_sertype*, const ddsi_serdata* serdata, char* text, size_t size) {
  const int length = std::snprintf(text, size, "(%u bytes)", cdr(serdata).size);
  return static_cast<size_t>(std::max(length, 0));
}

void get_keyhash(const ddsi_serdata*, ddsi_keyhash* hash, bool) { *hash = ddsi_keyhash{}; }

void free_sertype(ddsi_sertype* type) {
  ddsi_sertype_fini(type);
  delete type;
}

void zero_samples(const ddsi_sertype*, void* samples, size_t count) {
  std::fill_n(static_cast<CdrView*>(samples), count, CdrView{});
}

void realloc_samples(void** samples, const ddsi_sertype*, void* old, size_t old_count,
                     size_t count) {
  auto* memory = static_cast<CdrView*>(ddsrt_realloc(old, count * sizeof(CdrView)));
  for (size_t i = 0; i < count; ++i) {
    if (i >= old_count) new (memory + i) CdrView{};
    samples[i] = memory + i;
  }
}

void free_samples(const ddsi_sertype*, void** samples, size_t count, dds_free_op_t op) {
  if (count > 0 && (op & DDS_FREE_ALL_BIT) != 0) ddsrt_free(samples[0]);
}

bool equal(const ddsi_sertype*, const ddsi_sertype*) { return true; }

std::uint32_t hash(const ddsi_sertype*) { return 0; }

const ddsi_sertype_ops kSertypeOps = {
    .version = ddsi_sertype_v0,
    .arg = nullptr,
    .free = free_sertype,
    .zero_samples = zero_samples,
    .realloc_samples = realloc_samples,
    .free_samples = free_samples,
    .equal = equal,
    .hash = hash,
    .type_id = nullptr,  // no type information: readers and writers match by name
    .type_map = nullptr,
    .type_info = nullptr,
    .derive_sertype = nullptr,
    .get_serialized_size = nullptr,  // of shared memory, which these types do not use
    .serialize_into = nullptr,
};

const ddsi_serdata_ops kSerdataOps = {
    .eqkey = eqkey,
    .get_size = get_size,
    .from_ser = from_ser,
    .from_ser_iov = from_ser_iov,
    .from_keyhash = from_keyhash,
    .from_sample = from_sample,
    .to_ser = to_ser,
    .to_ser_ref = to_ser_ref,
    .to_ser_unref = to_ser_unref,
    .to_sample = to_sample,
    .to_untyped = to_untyped,
    .untyped_to_sample = untyped_to_sample,
    .free = free_serdata,
    .print = print,
    .get_keyhash = get_keyhash,
    .get_sample_size = nullptr,
    .from_iox_buffer = nullptr,
};

}  // namespace

ddsi_sertype* new_cdr_sertype(const std::string& dds_type) {
  auto type = std::make_unique<ddsi_sertype>();
  ddsi_sertype_init(type.get(), dds_type.c_str(), &kSertypeOps, &kSerdataOps, true);
  // As for types with a descriptor, so that both can stand behind one topic of a participant;
  // readers and writers ask for XCDR1.
  type->allowed_data_representation = DDS_DATA_REPRESENTATION_RESTRICT_DEFAULT;
  return type.release();
}

CdrBytes bytes_of(const ddsi_serdata& serdata) {
  return {cdr(&serdata).data.get(), cdr(&serdata).size};
}

}  // namespace sovo::bridge
