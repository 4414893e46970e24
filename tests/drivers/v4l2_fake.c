/* Plays USB cameras to an unmodified program: preloaded, it answers for the files videoN in the
 * folder V4L2_FAKE_ROOT/dev what the kernel's uvcvideo would answer.
 *
 * A test steers them through the file V4L2_FAKE_ROOT/page, mapped by both sides. A descriptor is a
 * memory file that holds the buffers, so that the program's own mmap works on it.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <linux/videodev2.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/select.h>
#include <time.h>
#include <unistd.h>

#define N_CAMERAS 16
#define N_BUFFERS 8
#define BUFFER_SIZE (1280 * 720 * 2)

/* One camera's line of the page; tests/drivers/preloaded_v4l2.py packs the same. */
struct line {
    int32_t is_plugged, is_stalled, has_no_bandwidth, is_forbidden, n_open;
    double offset_s;
};

enum { EXPOSURE_AUTO, EXPOSURE, GAIN, WB_AUTO, WB, FOCUS_AUTO, FOCUS, N_CONTROLS };
static const struct { uint32_t id; int32_t low, high, step, start; const char *name; } CONTROLS[] = {
    {V4L2_CID_EXPOSURE_AUTO, 0, 3, 1, 3, "Exposure, Auto"},
    {V4L2_CID_EXPOSURE_ABSOLUTE, 3, 2047, 1, 250, "Exposure (Absolute)"},
    {V4L2_CID_GAIN, 0, 255, 1, 0, "Gain"},
    {V4L2_CID_AUTO_WHITE_BALANCE, 0, 1, 1, 1, "White Balance, Auto"},
    {V4L2_CID_WHITE_BALANCE_TEMPERATURE, 2800, 6500, 10, 4000, "White Balance"},
    {V4L2_CID_FOCUS_AUTO, 0, 1, 1, 1, "Focus, Auto"},
    {V4L2_CID_FOCUS_ABSOLUTE, 0, 250, 5, 0, "Focus"},
};
static const uint32_t FORMATS[] = {V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_MJPEG};
static const int SIZES[][2] = {{640, 480}, {1280, 720}};
static const int RATES_HZ[] = {15, 30};

struct done { int buffer; uint32_t sequence; double stamp_s; };

struct device {
    int fd, camera;
    uint32_t format, width, height, rate_hz, n_buffers, length;
    int32_t controls[N_CONTROLS];
    int is_streaming;
    uint8_t *memory;
    int queued[N_BUFFERS], n_queued;
    struct done done[N_BUFFERS];
    int n_done;
    long long next_frame;
    uint8_t *jpeg;
    size_t jpeg_size;
};

static struct device *devices[N_CAMERAS];
static struct line *page;
static int (*real_open)(const char *, int, ...);
static int (*real_close)(int);
static int (*real_ioctl)(int, unsigned long, ...);
static int (*real_select)(int, fd_set *, fd_set *, fd_set *, struct timeval *);

static double now_s(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec + t.tv_nsec * 1e-9;
}

__attribute__((constructor)) static void start(void) {
    real_open = dlsym(RTLD_NEXT, "open");
    real_close = dlsym(RTLD_NEXT, "close");
    real_ioctl = dlsym(RTLD_NEXT, "ioctl");
    real_select = dlsym(RTLD_NEXT, "select");
    char name[PATH_MAX];
    const char *root = getenv("V4L2_FAKE_ROOT");
    if (!root) return;
    snprintf(name, sizeof name, "%s/page", root);
    int fd = real_open(name, O_RDWR);
    if (fd < 0) return;
    void *mapped = mmap(NULL, N_CAMERAS * sizeof *page, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
    if (mapped != MAP_FAILED) page = mapped;
    real_close(fd);
}

/* Number of the camera behind a path, -1 when it is none of ours. */
static int camera_at(const char *path) {
    const char *root = getenv("V4L2_FAKE_ROOT");
    char real[PATH_MAX], device[PATH_MAX];
    int number;
    if (!page || !root || strncmp(path, root, strlen(root)) || !realpath(path, real)) return -1;
    snprintf(device, sizeof device, "%s/dev/video%%d", root);
    return sscanf(real, device, &number) == 1 && number < N_CAMERAS ? number : -1;
}

static struct device *device_of(int fd) {
    for (int i = 0; i < N_CAMERAS; i++)
        if (devices[i] && devices[i]->fd == fd) return devices[i];
    return NULL;
}

static void set_format(struct device *d, uint32_t format, uint32_t width, uint32_t height) {
    d->format = format == V4L2_PIX_FMT_MJPEG ? format : V4L2_PIX_FMT_YUYV;
    int size = width >= 1280 && height >= 720;
    d->width = SIZES[size][0];
    d->height = SIZES[size][1];
}

static int open_camera(int camera) {
    if (!page[camera].is_plugged) return errno = ENODEV, -1;
    if (page[camera].is_forbidden) return errno = EACCES, -1;
    if (devices[camera]) return errno = EBUSY, -1;
    struct device *d = calloc(1, sizeof *d);
    d->fd = memfd_create("v4l2-fake", MFD_CLOEXEC);
    d->camera = camera;
    d->rate_hz = 30;
    set_format(d, V4L2_PIX_FMT_YUYV, 640, 480);
    for (int i = 0; i < N_CONTROLS; i++) d->controls[i] = CONTROLS[i].start;
    devices[camera] = d;
    page[camera].n_open++;
    return d->fd;
}

int open(const char *path, int flags, ...) {
    va_list rest;
    va_start(rest, flags);
    int mode = va_arg(rest, int);
    va_end(rest);
    if (!real_open) real_open = dlsym(RTLD_NEXT, "open");
    int camera = camera_at(path);
    return camera < 0 ? real_open(path, flags, mode) : open_camera(camera);
}

int open64(const char *path, int flags, ...) {
    va_list rest;
    va_start(rest, flags);
    int mode = va_arg(rest, int);
    va_end(rest);
    return open(path, flags | O_LARGEFILE, mode);
}

static void stop(struct device *d) {
    d->is_streaming = d->n_queued = d->n_done = 0;
    free(d->jpeg);
    d->jpeg = NULL;
}

static void drop_buffers(struct device *d) {
    if (d->memory) munmap(d->memory, (size_t)d->n_buffers * BUFFER_SIZE);
    d->memory = NULL;
    d->n_buffers = 0;
}

int close(int fd) {
    if (!real_close) real_close = dlsym(RTLD_NEXT, "close");
    struct device *d = device_of(fd);
    if (d) {
        stop(d);
        drop_buffers(d);
        page[d->camera].n_open--;
        devices[d->camera] = NULL;
        free(d);
    }
    return real_close(fd);
}

static double exposure_s(const struct device *d) { return d->controls[EXPOSURE] * 1e-4; }

/* When exposure number n begins. */
static double start_s(const struct device *d, long long n) {
    return page[d->camera].offset_s + (double)n / d->rate_hz;
}

static void fill(struct device *d, int buffer, uint32_t sequence) {
    uint8_t *to = d->memory + (size_t)buffer * BUFFER_SIZE;
    if (d->format == V4L2_PIX_FMT_MJPEG) {
        memcpy(to, d->jpeg, d->length = d->jpeg_size);
        return;
    }
    d->length = d->width * d->height * 2;
    for (uint32_t i = 0; i < d->length; i += 2) {
        to[i] = 16 + sequence % 200;
        to[i + 1] = 128;
    }
}

/* Exposures that ended meanwhile go into the buffers that waited for them; others are lost. */
static void advance(struct device *d) {
    double now = now_s();
    if (!d->is_streaming || page[d->camera].is_stalled) return;
    while (start_s(d, d->next_frame) + exposure_s(d) <= now) {
        long long n = d->next_frame++;
        if (!d->n_queued) continue;
        struct done done = {d->queued[0], (uint32_t)n, start_s(d, n)};
        memmove(d->queued, d->queued + 1, --d->n_queued * sizeof *d->queued);
        fill(d, done.buffer, done.sequence);
        d->done[d->n_done++] = done;
    }
}

static int stream_on(struct device *d) {
    if (page[d->camera].has_no_bandwidth) return errno = ENOSPC, -1;
    if (d->format == V4L2_PIX_FMT_MJPEG) {
        char name[PATH_MAX];
        snprintf(name, sizeof name, "%s/%dx%d.jpg", getenv("V4L2_FAKE_ROOT"), d->width, d->height);
        FILE *file = fopen(name, "rb");
        if (!file) return errno = EIO, -1;
        d->jpeg = malloc(BUFFER_SIZE);
        d->jpeg_size = fread(d->jpeg, 1, BUFFER_SIZE, file);
        fclose(file);
    }
    d->next_frame = (long long)((now_s() - page[d->camera].offset_s) * d->rate_hz) + 1;
    d->is_streaming = 1;
    return 0;
}

static int request_buffers(struct device *d, struct v4l2_requestbuffers *r) {
    if (d->is_streaming) return errno = EBUSY, -1;
    drop_buffers(d);
    if (r->count > N_BUFFERS) r->count = N_BUFFERS;
    if (!r->count) return 0;
    size_t size = (size_t)r->count * BUFFER_SIZE;
    if (ftruncate(d->fd, size)) return -1;
    void *memory = mmap(NULL, size, PROT_READ | PROT_WRITE, MAP_SHARED, d->fd, 0);
    if (memory == MAP_FAILED) return -1;
    d->memory = memory;
    d->n_buffers = r->count;
    return 0;
}

static int dequeue(struct device *d, struct v4l2_buffer *b) {
    advance(d);
    if (!d->n_done) return errno = EAGAIN, -1;
    struct done done = d->done[0];
    memmove(d->done, d->done + 1, --d->n_done * sizeof *d->done);
    b->index = done.buffer;
    b->bytesused = d->length;
    b->length = BUFFER_SIZE;
    b->sequence = done.sequence;
    b->flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
    b->timestamp.tv_sec = (long)done.stamp_s;
    b->timestamp.tv_usec = (long)((done.stamp_s - (long)done.stamp_s) * 1e6);
    return 0;
}

static int control_index(uint32_t id) {
    for (int i = 0; i < N_CONTROLS; i++)
        if (CONTROLS[i].id == id) return i;
    return -1;
}

static int set_control(struct device *d, uint32_t id, int32_t value) {
    int i = control_index(id);
    if (i < 0) return errno = EINVAL, -1;
    int is_automatic = (i == EXPOSURE && d->controls[EXPOSURE_AUTO] != 1) ||
                       (i == WB && d->controls[WB_AUTO]) || (i == FOCUS && d->controls[FOCUS_AUTO]);
    if (is_automatic) return errno = EACCES, -1;
    /* A webcam's menu of automatics has 1 and 3 only. */
    if (i == EXPOSURE_AUTO && value != 1 && value != 3) return errno = ERANGE, -1;
    if (value < CONTROLS[i].low) value = CONTROLS[i].low;
    if (value > CONTROLS[i].high) value = CONTROLS[i].high;
    int steps = (value - CONTROLS[i].low + CONTROLS[i].step / 2) / CONTROLS[i].step;
    d->controls[i] = CONTROLS[i].low + steps * CONTROLS[i].step;
    return 0;
}

static int query_control(struct v4l2_queryctrl *q) {
    int i = control_index(q->id);
    if (i < 0) return errno = EINVAL, -1;
    q->type = V4L2_CTRL_TYPE_INTEGER;
    snprintf((char *)q->name, sizeof q->name, "%s", CONTROLS[i].name);
    q->minimum = CONTROLS[i].low;
    q->maximum = CONTROLS[i].high;
    q->step = CONTROLS[i].step;
    q->default_value = CONTROLS[i].start;
    q->flags = 0;
    return 0;
}

static int all_controls(struct device *d, struct v4l2_ext_controls *all, int is_set) {
    for (uint32_t k = 0; k < all->count; k++) {
        struct v4l2_ext_control *one = &all->controls[k];
        int i = control_index(one->id);
        if (i < 0) return errno = EINVAL, -1;
        if (!is_set) one->value = d->controls[i];
        else if (set_control(d, one->id, one->value)) return -1;
    }
    return 0;
}

static void tell_format(const struct device *d, struct v4l2_format *f) {
    f->fmt.pix.width = d->width;
    f->fmt.pix.height = d->height;
    f->fmt.pix.pixelformat = d->format;
    f->fmt.pix.field = V4L2_FIELD_NONE;
    f->fmt.pix.bytesperline = d->format == V4L2_PIX_FMT_YUYV ? d->width * 2 : 0;
    f->fmt.pix.sizeimage = BUFFER_SIZE;
    f->fmt.pix.colorspace = V4L2_COLORSPACE_SRGB;
}

static void tell_rate(struct device *d, struct v4l2_streamparm *p, int is_set) {
    struct v4l2_fract *period = &p->parm.capture.timeperframe;
    if (is_set && period->numerator)
        d->rate_hz = RATES_HZ[period->denominator / period->numerator >= 30];
    memset(&p->parm, 0, sizeof p->parm);
    p->parm.capture.capability = V4L2_CAP_TIMEPERFRAME;
    period->numerator = 1;
    period->denominator = d->rate_hz;
}

static int tell_capability(const struct device *d, struct v4l2_capability *c) {
    memset(c, 0, sizeof *c);
    strcpy((char *)c->driver, "uvcvideo");
    snprintf((char *)c->card, sizeof c->card, "Fake camera %d", d->camera);
    snprintf((char *)c->bus_info, sizeof c->bus_info, "usb-fake-%d", d->camera);
    c->device_caps = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
    c->capabilities = c->device_caps | V4L2_CAP_DEVICE_CAPS;
    return 0;
}

static int list_formats(struct v4l2_fmtdesc *f) {
    if (f->index >= 2) return errno = EINVAL, -1;
    f->pixelformat = FORMATS[f->index];
    f->flags = f->index ? V4L2_FMT_FLAG_COMPRESSED : 0;
    strcpy((char *)f->description, f->index ? "Motion-JPEG" : "YUYV 4:2:2");
    return 0;
}

static int is_known(uint32_t format) { return format == FORMATS[0] || format == FORMATS[1]; }

static int list_sizes(struct v4l2_frmsizeenum *f) {
    if (f->index >= 2 || !is_known(f->pixel_format)) return errno = EINVAL, -1;
    f->type = V4L2_FRMSIZE_TYPE_DISCRETE;
    f->discrete.width = SIZES[f->index][0];
    f->discrete.height = SIZES[f->index][1];
    return 0;
}

static int list_rates(struct v4l2_frmivalenum *f) {
    if (f->index >= 2 || !is_known(f->pixel_format)) return errno = EINVAL, -1;
    f->type = V4L2_FRMIVAL_TYPE_DISCRETE;
    f->discrete.numerator = 1;
    f->discrete.denominator = RATES_HZ[f->index];
    return 0;
}

static int change_format(struct device *d, struct v4l2_format *f, int is_tried) {
    if (d->n_buffers && !is_tried) return errno = EBUSY, -1;
    struct device copy = *d, *to = is_tried ? &copy : d;
    set_format(to, f->fmt.pix.pixelformat, f->fmt.pix.width, f->fmt.pix.height);
    tell_format(to, f);
    return 0;
}

static int answer(struct device *d, unsigned long request, void *data) {
    struct v4l2_buffer *buffer = data;
    struct v4l2_control *control = data;
    if (!page[d->camera].is_plugged) return errno = ENODEV, -1;
    switch (request) {
    case VIDIOC_QUERYCAP: return tell_capability(d, data);
    case VIDIOC_ENUMINPUT: return *(uint32_t *)data ? (errno = EINVAL, -1) : 0;
    case VIDIOC_G_INPUT: return *(int *)data = 0;
    case VIDIOC_S_INPUT: return 0;
    case VIDIOC_ENUM_FMT: return list_formats(data);
    case VIDIOC_ENUM_FRAMESIZES: return list_sizes(data);
    case VIDIOC_ENUM_FRAMEINTERVALS: return list_rates(data);
    case VIDIOC_G_FMT: return tell_format(d, data), 0;
    case VIDIOC_TRY_FMT: return change_format(d, data, 1);
    case VIDIOC_S_FMT: return change_format(d, data, 0);
    case VIDIOC_G_PARM: return tell_rate(d, data, 0), 0;
    case VIDIOC_S_PARM: return tell_rate(d, data, 1), 0;
    case VIDIOC_REQBUFS: return request_buffers(d, data);
    case VIDIOC_QUERYBUF:
        if (buffer->index >= d->n_buffers) return errno = EINVAL, -1;
        buffer->length = BUFFER_SIZE;
        buffer->m.offset = buffer->index * BUFFER_SIZE;
        return 0;
    case VIDIOC_QBUF:
        advance(d);
        d->queued[d->n_queued++] = buffer->index;
        return 0;
    case VIDIOC_DQBUF: return dequeue(d, buffer);
    case VIDIOC_STREAMON: return stream_on(d);
    case VIDIOC_STREAMOFF: return stop(d), 0;
    case VIDIOC_QUERYCTRL: return query_control(data);
    case VIDIOC_G_CTRL:
        if (control_index(control->id) < 0) return errno = EINVAL, -1;
        return control->value = d->controls[control_index(control->id)], 0;
    case VIDIOC_S_CTRL: return set_control(d, control->id, control->value);
    case VIDIOC_G_EXT_CTRLS: return all_controls(d, data, 0);
    case VIDIOC_S_EXT_CTRLS: return all_controls(d, data, 1);
    default: return errno = ENOTTY, -1;
    }
}

int ioctl(int fd, unsigned long request, ...) {
    va_list rest;
    va_start(rest, request);
    void *data = va_arg(rest, void *);
    va_end(rest);
    if (!real_ioctl) real_ioctl = dlsym(RTLD_NEXT, "ioctl");
    struct device *d = device_of(fd);
    return d ? answer(d, (uint32_t)request, data) : real_ioctl(fd, request, data);
}

int select(int n, fd_set *reading, fd_set *writing, fd_set *special, struct timeval *patience) {
    if (!real_select) real_select = dlsym(RTLD_NEXT, "select");
    struct device *d = NULL;
    for (int fd = 0; reading && fd < n && !d; fd++)
        if (FD_ISSET(fd, reading)) d = device_of(fd);
    if (!d) return real_select(n, reading, writing, special, patience);
    double end_s = now_s() + (patience ? patience->tv_sec + patience->tv_usec * 1e-6 : 1e9);
    for (;;) {
        advance(d);
        if (d->n_done || !page[d->camera].is_plugged) return 1;
        if (now_s() >= end_s) {
            FD_ZERO(reading);
            return 0;
        }
        usleep(500);
    }
}
