/* Layout of the kernel's structures, as its header states it: a line of name and number each. */
#include <linux/videodev2.h>
#include <stddef.h>
#include <stdio.h>

#define SIZE(type) printf(#type " %zu\n", sizeof(struct type))
#define AT(type, member) printf(#type "." #member " %zu\n", offsetof(struct type, member))
#define NUMBER(name) printf(#name " %llu\n", (unsigned long long)(name))

int main(void)
{
    SIZE(v4l2_capability);
    AT(v4l2_capability, capabilities);
    AT(v4l2_capability, device_caps);
    SIZE(v4l2_fmtdesc);
    AT(v4l2_fmtdesc, type);
    AT(v4l2_fmtdesc, pixelformat);
    SIZE(v4l2_frmsizeenum);
    AT(v4l2_frmsizeenum, pixel_format);
    AT(v4l2_frmsizeenum, type);
    AT(v4l2_frmsizeenum, discrete.width);
    AT(v4l2_frmsizeenum, discrete.height);
    SIZE(v4l2_frmivalenum);
    AT(v4l2_frmivalenum, width);
    AT(v4l2_frmivalenum, type);
    AT(v4l2_frmivalenum, discrete.numerator);
    AT(v4l2_frmivalenum, discrete.denominator);
    SIZE(v4l2_format);
    AT(v4l2_format, fmt.pix.width);
    AT(v4l2_format, fmt.pix.pixelformat);
    AT(v4l2_format, fmt.pix.bytesperline);
    AT(v4l2_format, fmt.pix.sizeimage);
    SIZE(v4l2_streamparm);
    AT(v4l2_streamparm, parm.capture.timeperframe.numerator);
    AT(v4l2_streamparm, parm.capture.timeperframe.denominator);
    SIZE(v4l2_requestbuffers);
    AT(v4l2_requestbuffers, count);
    AT(v4l2_requestbuffers, memory);
    SIZE(v4l2_buffer);
    AT(v4l2_buffer, index);
    AT(v4l2_buffer, bytesused);
    AT(v4l2_buffer, flags);
    AT(v4l2_buffer, timestamp.tv_sec);
    AT(v4l2_buffer, timestamp.tv_usec);
    AT(v4l2_buffer, memory);
    AT(v4l2_buffer, m.offset);
    AT(v4l2_buffer, length);
    NUMBER(VIDIOC_QUERYCAP);
    NUMBER(VIDIOC_ENUM_FMT);
    NUMBER(VIDIOC_S_FMT);
    NUMBER(VIDIOC_REQBUFS);
    NUMBER(VIDIOC_QUERYBUF);
    NUMBER(VIDIOC_QBUF);
    NUMBER(VIDIOC_DQBUF);
    NUMBER(VIDIOC_STREAMON);
    NUMBER(VIDIOC_STREAMOFF);
    NUMBER(VIDIOC_S_PARM);
    NUMBER(VIDIOC_ENUM_FRAMESIZES);
    NUMBER(VIDIOC_ENUM_FRAMEINTERVALS);
    NUMBER(V4L2_BUF_TYPE_VIDEO_CAPTURE);
    NUMBER(V4L2_MEMORY_MMAP);
    NUMBER(V4L2_CAP_VIDEO_CAPTURE);
    NUMBER(V4L2_CAP_STREAMING);
    NUMBER(V4L2_CAP_DEVICE_CAPS);
    NUMBER(V4L2_FRMSIZE_TYPE_DISCRETE);
    NUMBER(V4L2_BUF_FLAG_ERROR);
    NUMBER(V4L2_PIX_FMT_Z16);
    NUMBER(V4L2_PIX_FMT_YUYV);
    NUMBER(V4L2_PIX_FMT_UYVY);
    NUMBER(V4L2_PIX_FMT_MJPEG);
    return 0;
}
