/*
 * A stand-in for the kernel's video nodes, loaded before the C library: it is no camera and no kernel.
 *
 * Files named video0 (Z16, 64x48), video1 (metadata) and video2 (YUYV, 32x24) answer requests as uvcvideo does for a
 * RealSense. Image n of depth is all 1000 + n, of colour all of luma 16 + n, both at n / 30 s, 20 images long; then the
 * camera is unplugged. Depth image 3 is marked as damaged. Rows of colour are padded by 8 bytes.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <linux/videodev2.h>
#include <stdarg.h>
#include <stdint.h>
#include <string.h>
#include <sys/mman.h>
#include <time.h>
#include <unistd.h>

enum { BUFFERS = 4, IMAGES = 20, PERIOD_US = 33333 };

struct node {
    int fd, number, queued[BUFFERS], count, is_on;
    unsigned image;
    struct timespec begun;
};

static struct node nodes[3];

static unsigned width(const struct node *n) { return n->number == 0 ? 64 : 32; }
static unsigned height(const struct node *n) { return n->number == 0 ? 48 : 24; }
static unsigned line(const struct node *n) { return 2 * width(n) + (n->number == 0 ? 0 : 8); }
static unsigned bytes(const struct node *n) { return line(n) * height(n); }
static unsigned format(const struct node *n) { return n->number == 0 ? V4L2_PIX_FMT_Z16 : V4L2_PIX_FMT_YUYV; }
/* Buffers begin on pages. */
static unsigned step(const struct node *n) { return (bytes(n) + 4095) / 4096 * 4096; }

static int opened(const char *path, int flags)
{
    const char *name = strrchr(path, '/');
    if (!name || strncmp(name, "/video", 6) || strlen(name) != 7 || name[6] > '2')
        return -1;
    struct node *n = &nodes[name[6] - '0'];
    memset(n, 0, sizeof *n);
    n->number = name[6] - '0';
    int fd = memfd_create("node", 0);
    /* Of a node that was closed. */
    for (int i = 0; i < 3; i++)
        if (nodes[i].fd == fd)
            nodes[i].fd = 0;
    n->fd = fd;
    if (ftruncate(n->fd, BUFFERS * (off_t)step(n)) < 0 || !(flags & O_NONBLOCK))
        return -1;
    return n->fd;
}

int open64(const char *path, int flags, ...)
{
    va_list args;
    va_start(args, flags);
    int mode = flags & O_CREAT ? va_arg(args, int) : 0;
    va_end(args);
    int fd = opened(path, flags);
    if (fd >= 0)
        return fd;
    int (*next)(const char *, int, ...) = (int (*)(const char *, int, ...))dlsym(RTLD_NEXT, "open64");
    return next(path, flags, mode);
}

int open(const char *path, int flags, ...)
{
    va_list args;
    va_start(args, flags);
    int mode = flags & O_CREAT ? va_arg(args, int) : 0;
    va_end(args);
    return open64(path, flags, mode);
}

static int fail(int code)
{
    errno = code;
    return -1;
}

static void draw(const struct node *n, unsigned index)
{
    unsigned char image[16384];
    for (unsigned i = 0; i < bytes(n) / 2; i++) {
        uint16_t value = n->number == 0 ? 1000 + n->image : 0x8000 | (16 + n->image);
        memcpy(image + 2 * i, &value, 2);
    }
    if (pwrite(n->fd, image, bytes(n), (off_t)index * step(n)) < 0)
        _exit(9);
}

static int dequeue(struct node *n, struct v4l2_buffer *b)
{
    if (!n->is_on || n->count == 0)
        return fail(EINVAL);
    if (n->image == IMAGES)
        return fail(ENODEV);
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    long us = (now.tv_sec - n->begun.tv_sec) * 1000000 + (now.tv_nsec - n->begun.tv_nsec) / 1000;
    if (us < (long)(n->image + 1) * PERIOD_US) {
        /* Files are always readable: a moment's sleep in place of poll. */
        usleep(1000);
        return fail(EAGAIN);
    }
    b->index = n->queued[0];
    memmove(n->queued, n->queued + 1, sizeof n->queued - sizeof *n->queued);
    n->count--;
    draw(n, b->index);
    b->bytesused = bytes(n);
    b->flags = n->number == 0 && n->image == 3 ? V4L2_BUF_FLAG_ERROR : 0;
    b->timestamp.tv_sec = n->image * PERIOD_US / 1000000;
    b->timestamp.tv_usec = n->image * PERIOD_US % 1000000;
    n->image++;
    return 0;
}

static int answer(struct node *n, unsigned long request, void *argument)
{
    switch (request) {
    case VIDIOC_QUERYCAP: {
        struct v4l2_capability *c = argument;
        c->capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING | V4L2_CAP_DEVICE_CAPS;
        c->device_caps = V4L2_CAP_STREAMING | (n->number == 1 ? V4L2_CAP_META_CAPTURE : V4L2_CAP_VIDEO_CAPTURE);
        return 0;
    }
    case VIDIOC_ENUM_FMT: {
        struct v4l2_fmtdesc *f = argument;
        if (f->index > 0 || f->type != V4L2_BUF_TYPE_VIDEO_CAPTURE)
            return fail(EINVAL);
        f->pixelformat = format(n);
        return 0;
    }
    case VIDIOC_ENUM_FRAMESIZES: {
        struct v4l2_frmsizeenum *s = argument;
        if (s->index > 0 || s->pixel_format != format(n))
            return fail(EINVAL);
        s->type = V4L2_FRMSIZE_TYPE_DISCRETE;
        s->discrete.width = width(n);
        s->discrete.height = height(n);
        return 0;
    }
    case VIDIOC_ENUM_FRAMEINTERVALS: {
        struct v4l2_frmivalenum *i = argument;
        static const unsigned rates[] = {15, 30, 6};
        if (i->index > 2 || i->width != width(n) || i->height != height(n))
            return fail(EINVAL);
        i->type = V4L2_FRMIVAL_TYPE_DISCRETE;
        i->discrete.numerator = 1;
        i->discrete.denominator = rates[i->index];
        return 0;
    }
    case VIDIOC_S_FMT: {
        struct v4l2_format *f = argument;
        f->fmt.pix.width = width(n);
        f->fmt.pix.height = height(n);
        f->fmt.pix.pixelformat = format(n);
        f->fmt.pix.bytesperline = line(n);
        f->fmt.pix.sizeimage = bytes(n);
        return 0;
    }
    case VIDIOC_S_PARM: {
        struct v4l2_streamparm *p = argument;
        const struct v4l2_fract *t = &p->parm.capture.timeperframe;
        return t->numerator == 1 && t->denominator == 30 ? 0 : fail(EINVAL);
    }
    case VIDIOC_REQBUFS: {
        struct v4l2_requestbuffers *r = argument;
        if (r->memory != V4L2_MEMORY_MMAP)
            return fail(EINVAL);
        r->count = BUFFERS;
        return 0;
    }
    case VIDIOC_QUERYBUF: {
        struct v4l2_buffer *b = argument;
        b->length = bytes(n);
        b->m.offset = b->index * step(n);
        return 0;
    }
    case VIDIOC_QBUF: {
        struct v4l2_buffer *b = argument;
        if (n->count == BUFFERS || b->index >= BUFFERS)
            return fail(EINVAL);
        n->queued[n->count++] = b->index;
        return 0;
    }
    case VIDIOC_DQBUF:
        return dequeue(n, argument);
    case VIDIOC_STREAMON:
        n->is_on = *(int *)argument == V4L2_BUF_TYPE_VIDEO_CAPTURE;
        clock_gettime(CLOCK_MONOTONIC, &n->begun);
        return n->is_on ? 0 : fail(EINVAL);
    case VIDIOC_STREAMOFF:
        n->is_on = 0;
        return 0;
    default:
        return fail(ENOTTY);
    }
}

int ioctl(int fd, unsigned long request, ...)
{
    va_list args;
    va_start(args, request);
    void *argument = va_arg(args, void *);
    va_end(args);
    for (int i = 0; i < 3; i++)
        if (nodes[i].fd == fd && fd > 0)
            return answer(&nodes[i], request, argument);
    int (*next)(int, unsigned long, ...) = (int (*)(int, unsigned long, ...))dlsym(RTLD_NEXT, "ioctl");
    return next(fd, request, argument);
}
