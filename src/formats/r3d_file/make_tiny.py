# Writes tiny.r3d: three frames, own content. Oracle of LZFSE: pyliblzfse (Apple's reference).
import json, zipfile, io, numpy as np, liblzfse
from PIL import Image
W,H,DW,DH=96,128,48,64
v,u=np.mgrid[0:DH,0:DW]
meta=dict(w=W,h=H,dw=DW,dh=DH,fps=60,K=[120.0,0,0,0,124.0,0,47.5,63.5,1.0],
  frameTimestamps=[0.0,0.0166,0.0333],poses=[[0,0,0,1,0,0,0]]*3,initPose=[0,0,0,1,0,0,0],
  perFrameIntrinsicCoeffs=[[120.0,124.0,47.5,63.5],[121.2,125.2,47.5,63.5],[120.0,124.0,47.5,63.5]])
z=zipfile.ZipFile('tiny.r3d','w',zipfile.ZIP_DEFLATED)
z.writestr('metadata',json.dumps(meta))
for i in (0,1,2):
    d=(1.0+0.002*v+0.001*u+0.1*i).astype('<f4')
    d[0,0]=np.nan; d[1,0]=0; d[2,0]=70
    raw = d.tobytes() if i<2 else np.where(np.isfinite(d)&(d<65),np.round(d*1000),0).astype('<u2').tobytes()
    z.writestr(f'rgbd/{i}.depth',liblzfse.compress(raw))
    img=np.zeros((H,W,3),'u1'); img[...]=[40*i+20,100,200]
    b=io.BytesIO(); Image.fromarray(img).save(b,'JPEG',quality=95); z.writestr(f'rgbd/{i}.jpg',b.getvalue())
    z.writestr(f'rgbd/{i}.conf',liblzfse.compress(bytes([2])*(DW*DH)))
z.close()
