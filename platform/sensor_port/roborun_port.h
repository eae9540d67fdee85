/// The sensor port: how another process hands what a sensor measures to roborun. One file of shared memory per device,
/// /dev/shm/roborun-NAME. This header is all that a feeder needs: C99 and C++, GCC or Clang, Linux.
///
///   struct roborun_port_writer w;
///   const char* wrong = roborun_port_open(&w, "/dev/shm/roborun-front", ROBORUN_PORT_DEPTH, 640 * 480 * 4, 4);
///   if (wrong) { fprintf(stderr, "%s\n", wrong); return 1; }
///   struct roborun_port_depth image = {...};
///   roborun_port_write(&w, &image, pixels, 640 * 480 * 4);
///
/// A file is a header and a ring of slots, all in the byte order of the machine and at multiples of 64 bytes. Slot i holds
/// sample n for the greatest n below `written` with n % slot_count == i. A slot's guard is 2 n + 1 while sample n is being
/// written and 2 n + 2 once it is whole: a reader copies, looks at the guard before and after, and takes only what did
/// not change in between. The writer never waits for a reader, and readers write nothing.
/* NOLINTBEGIN(readability-identifier-naming,modernize-use-nullptr): this is C */
#ifndef ROBORUN_PORT_H
#define ROBORUN_PORT_H

#include <errno.h>
#include <fcntl.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#ifdef __cplusplus
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wold-style-cast" /* C has no other */
extern "C" {
#endif

#define ROBORUN_PORT_MAGIC "roborunP"
#define ROBORUN_PORT_VERSION 1u
#define ROBORUN_PORT_MOST_SLOTS 1024u
#define ROBORUN_PORT_MOST_BYTES (64u << 20) /* of one slot */

enum roborun_port_kind {
  ROBORUN_PORT_DEPTH = 1,
  ROBORUN_PORT_CLOUD = 2,
  ROBORUN_PORT_ODOMETRY = 3,
  ROBORUN_PORT_IMU = 4,
  ROBORUN_PORT_GNSS = 5,
  ROBORUN_PORT_RANGE = 6,
  ROBORUN_PORT_PRESSURE = 7,
  ROBORUN_PORT_CAN = 8,
  ROBORUN_PORT_LINES = 9
};

struct roborun_port_header {
  char magic[8]; /* ROBORUN_PORT_MAGIC, without a zero at its end; written last */
  uint32_t version;
  uint32_t kind;
  uint32_t slot_count; /* 2 .. ROBORUN_PORT_MOST_SLOTS */
  uint32_t slot_bytes; /* guard, sample and payload: a multiple of 64 */
  uint32_t sample_bytes;
  uint32_t reserved;
  uint64_t writer;         /* another number with each start of a writer */
  uint64_t written;        /* samples since the file was made */
  int64_t clock_offset_ns; /* a stamp plus this is CLOCK_MONOTONIC of this machine */
  uint8_t padding[72];     /* to 128 bytes */
};

struct roborun_port_slot {
  uint64_t guard;
  uint32_t payload_bytes;
  uint32_t reserved;
  /* then the sample, and at the next multiple of 8 bytes the payload */
};

/* What every sample begins with. */
struct roborun_port_stamp {
  int64_t stamp_ns;  /* the instant of measurement on the writer's clock */
  uint32_t sequence; /* grows by one with each measurement of the device, lost ones included */
  uint32_t reserved;
};

/* Where a sensor sits on the body (x forward, y left, z up), and how it is turned: from the sensor's frame to the body's. */
struct roborun_port_mount {
  float p_BS_m[3];
  float q_BS[4]; /* w, x, y, z */
};

enum roborun_port_pixel { ROBORUN_PORT_FLOAT32_M = 1, ROBORUN_PORT_UINT16 = 2 };

/* Row by row from the upper left: distance along the optical axis; 0 or NaN: nothing is known there. The camera frame has x forward,
   y left, z up. +infinity, or more than range_m: nothing is within range_m. */
struct roborun_port_depth {
  struct roborun_port_stamp at;
  uint32_t width, height; /* 8 .. 1280 */
  uint32_t pixel;         /* enum roborun_port_pixel */
  float unit_m;           /* of a uint16, such as 0.001 */
  float fx, fy, cx, cy;   /* pixels; the centre of the first pixel is (0, 0) */
  float range_min_m, range_m;
  float exposure_s;
  struct roborun_port_mount mount;
  uint32_t reserved;
};

/* Payload of a cloud: points in the sensor's frame, metres, each with its time. */
struct roborun_port_point {
  float x_m, y_m, z_m;
  float before_s; /* how long before the stamp it was measured; 0 if that is not known */
};
struct roborun_port_cloud {
  struct roborun_port_stamp at;
  uint32_t points;
  float range_min_m, range_m;
  struct roborun_port_mount mount;
  uint32_t reserved[2];
};

/* Frame O: z up, continuous, drifts, until reset_counter says that it begins anew. */
struct roborun_port_odometry {
  struct roborun_port_stamp at;
  uint32_t reset_counter;
  uint32_t reserved;
  double p_OB_m[3];
  double q_OB[4]; /* w, x, y, z */
  double v_OB_mps[3];
  float pose_variance[6];     /* x, y, z in m2, then about x, y, z in rad2 */
  float velocity_variance[3]; /* m2/s2 */
  uint32_t reserved2;
};

struct roborun_port_imu {
  struct roborun_port_stamp at;
  double angular_rate_B_radps[3];
  double specific_force_B_mps2[3]; /* (0, 0, +9.81) at rest */
};

struct roborun_port_gnss {
  struct roborun_port_stamp at;
  double latitude_deg, longitude_deg, height_m; /* WGS 84, above the ellipsoid */
  double v_ENU_mps[3];
  double heading_rad; /* of the body's x axis from East, counter-clockwise; NaN: not known */
  float sigma_horizontal_m, sigma_vertical_m, sigma_speed_mps, sigma_heading_rad;
};

struct roborun_port_range {
  struct roborun_port_stamp at;
  float distance_m; /* +infinity: nothing within range_m; NaN: nothing is known */
  float range_min_m, range_m;
  float sigma_m;
  struct roborun_port_mount mount; /* it measures along the sensor's x axis */
  uint32_t reserved;
};

/* Static pressure outside of the vehicle. */
struct roborun_port_pressure {
  struct roborun_port_stamp at;
  double pressure_Pa;
  float temperature_K; /* NaN: not known */
  uint32_t reserved;
};

/* A frame of a CAN bus with 29-bit identifiers: one port holds what a node hears, another one what it sends. */
struct roborun_port_can {
  struct roborun_port_stamp at; /* end of the frame on the bus; sent: when its content was made */
  uint32_t id;                  /* 29 bits */
  uint32_t size;                /* 0 .. 8 */
  uint8_t data[8];
};

enum roborun_port_line {
  ROBORUN_PORT_KILL_OPEN = 1,   /* normally open contact of the kill switch: active once it is pressed */
  ROBORUN_PORT_KILL_CLOSED = 2, /* normally closed contact: active until it is pressed */
  ROBORUN_PORT_OPERATOR = 4,    /* active: the operator is heard */
  ROBORUN_PORT_ARM = 8          /* arming switch: active once motors may turn */
};

/* Levels of lines, again and again: a line that nobody writes is one that is gone. */
struct roborun_port_lines {
  struct roborun_port_stamp at;
  uint32_t wired;  /* sum of enum roborun_port_line: what there is */
  uint32_t active; /* of those */
};

/* Bytes of a sample of this kind; 0: no such kind. */
static inline uint32_t roborun_port_sample_bytes(uint32_t kind) {
  switch (kind) {
    case ROBORUN_PORT_DEPTH: return (uint32_t)sizeof(struct roborun_port_depth);
    case ROBORUN_PORT_CLOUD: return (uint32_t)sizeof(struct roborun_port_cloud);
    case ROBORUN_PORT_ODOMETRY: return (uint32_t)sizeof(struct roborun_port_odometry);
    case ROBORUN_PORT_IMU: return (uint32_t)sizeof(struct roborun_port_imu);
    case ROBORUN_PORT_GNSS: return (uint32_t)sizeof(struct roborun_port_gnss);
    case ROBORUN_PORT_RANGE: return (uint32_t)sizeof(struct roborun_port_range);
    case ROBORUN_PORT_PRESSURE: return (uint32_t)sizeof(struct roborun_port_pressure);
    case ROBORUN_PORT_CAN: return (uint32_t)sizeof(struct roborun_port_can);
    case ROBORUN_PORT_LINES: return (uint32_t)sizeof(struct roborun_port_lines);
    default: return 0;
  }
}

static inline uint64_t roborun_port_file_bytes(uint32_t slot_count, uint32_t slot_bytes) {
  return sizeof(struct roborun_port_header) + (uint64_t)slot_count * slot_bytes;
}

/* One writer a file: a second one is refused, and one whose predecessor died goes on where that one stopped. */
struct roborun_port_writer {
  int file;
  uint64_t bytes;
  struct roborun_port_header* header;
};

static inline void roborun_port_close(struct roborun_port_writer* w) {
  if (w->header != NULL) munmap((void*)w->header, (size_t)w->bytes);
  if (w->file >= 0) close(w->file);
  w->header = NULL;
  w->file = -1;
}

/* A whole new file takes the place of the one at `path`, if there is one: readers of the old one notice. */
static inline const char* roborun_port_make(struct roborun_port_writer* w, const char* path,
                                            const struct roborun_port_header* wanted) {
  char part[512];
  int length = snprintf(part, sizeof part, "%s.%ld.part", path, (long)getpid());
  if (length < 0 || (size_t)length >= sizeof part) return "its path is too long";
  (void)unlink(part);
  int file = open(part, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0640);
  if (file < 0) return strerror(errno);
  if (flock(file, LOCK_EX | LOCK_NB) != 0 || ftruncate(file, (off_t)w->bytes) != 0 ||
      pwrite(file, wanted, sizeof *wanted, 0) != (ssize_t)sizeof *wanted || rename(part, path) != 0) {
    const char* why = strerror(errno);
    close(file);
    (void)unlink(part);
    return why;
  }
  w->file = file;
  return NULL;
}

/* Opens the port, or makes it with room for `slot_count` samples of at most `most_payload_bytes`. Returns NULL, or what is wrong. */
static inline const char* roborun_port_open(struct roborun_port_writer* w, const char* path, uint32_t kind,
                                            uint32_t most_payload_bytes, uint32_t slot_count) {
  struct roborun_port_header wanted, there;
  struct stat status;
  w->file = -1;
  w->header = NULL;
  if (roborun_port_sample_bytes(kind) == 0) return "no such kind of sensor";
  if (slot_count < 2 || slot_count > ROBORUN_PORT_MOST_SLOTS) return "slots: must be 2 to 1024";
  if (most_payload_bytes > ROBORUN_PORT_MOST_BYTES - 1024) return "payload: must be below 64 MiB";
  memset(&wanted, 0, sizeof wanted);
  memcpy(wanted.magic, ROBORUN_PORT_MAGIC, sizeof wanted.magic);
  wanted.version = ROBORUN_PORT_VERSION;
  wanted.kind = kind;
  wanted.slot_count = slot_count;
  wanted.sample_bytes = roborun_port_sample_bytes(kind);
  wanted.slot_bytes =
      (uint32_t)((sizeof(struct roborun_port_slot) + wanted.sample_bytes + most_payload_bytes + 63u) / 64u * 64u);
  w->bytes = roborun_port_file_bytes(slot_count, wanted.slot_bytes);
  int file = open(path, O_RDWR | O_CLOEXEC);
  if (file >= 0) {
    if (flock(file, LOCK_EX | LOCK_NB) != 0) {
      close(file);
      return "another process writes to this port";
    }
    /* What is before `writer` has to be the same. */
    if (pread(file, &there, sizeof there, 0) == (ssize_t)sizeof there && fstat(file, &status) == 0 &&
        (uint64_t)status.st_size == w->bytes &&
        memcmp(&there, &wanted, offsetof(struct roborun_port_header, writer)) == 0)
      w->file = file;
  } else if (errno != ENOENT) {
    return strerror(errno);
  }
  if (w->file < 0) {
    const char* wrong = roborun_port_make(w, path, &wanted);
    if (file >= 0) close(file); /* locked until here: no third writer came between */
    if (wrong != NULL) return wrong;
  }
  void* memory = mmap(NULL, (size_t)w->bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_POPULATE, w->file, 0);
  if (memory == MAP_FAILED) {
    const char* why = strerror(errno);
    roborun_port_close(w);
    return why;
  }
  w->header = (struct roborun_port_header*)memory;
  struct timespec now;
  (void)clock_gettime(CLOCK_MONOTONIC, &now);
  uint64_t started = (uint64_t)now.tv_sec * 1000000000u + (uint64_t)now.tv_nsec;
  __atomic_store_n(&w->header->writer, started, __ATOMIC_RELEASE);
  return NULL;
}

/* Eight bytes at a time, each of them whole; `bytes` are rounded up, and both sides have room for that. */
static inline void roborun_port_put(void* to, const void* from, size_t bytes) {
  uint64_t* out = (uint64_t*)to;
  const char* in = (const char*)from;
  uint64_t word = 0;
  for (; bytes >= 8; bytes -= 8, in += 8) {
    memcpy(&word, in, 8);
    __atomic_store_n(out++, word, __ATOMIC_RELAXED);
  }
  if (bytes == 0) return;
  word = 0;
  memcpy(&word, in, bytes);
  __atomic_store_n(out, word, __ATOMIC_RELAXED);
}

/* Writes one sample. Neither waits nor calls the system. 0: written; -1: larger than the port was made for. */
static inline int roborun_port_write(struct roborun_port_writer* w, const void* sample, const void* payload,
                                     uint32_t payload_bytes) {
  struct roborun_port_header* h = w->header;
  const size_t room = h->slot_bytes - sizeof(struct roborun_port_slot) - h->sample_bytes;
  if (payload_bytes > room) return -1;
  const uint64_t n = __atomic_load_n(&h->written, __ATOMIC_RELAXED);
  char* at = (char*)h + sizeof *h + (n % h->slot_count) * h->slot_bytes;
  struct roborun_port_slot* slot = (struct roborun_port_slot*)(void*)at;
  __atomic_store_n(&slot->guard, 2 * n + 1, __ATOMIC_RELAXED);
  __atomic_thread_fence(__ATOMIC_RELEASE); /* nobody sees new bytes under the old guard */
  __atomic_store_n(&slot->payload_bytes, payload_bytes, __ATOMIC_RELAXED);
  roborun_port_put(at + sizeof *slot, sample, h->sample_bytes);
  roborun_port_put(at + sizeof *slot + h->sample_bytes, payload, payload_bytes);
  __atomic_store_n(&slot->guard, 2 * n + 2, __ATOMIC_RELEASE);
  __atomic_store_n(&h->written, n + 1, __ATOMIC_RELEASE);
  return 0;
}

#ifdef __cplusplus
}
#pragma GCC diagnostic pop
#endif
#endif
/* NOLINTEND(readability-identifier-naming,modernize-use-nullptr) */
