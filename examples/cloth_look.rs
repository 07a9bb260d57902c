use tryon::body::*; use tryon::math::*; use tryon::garment::*; use tryon::dressing::*; use tryon::cloth::realtime::*; use tryon::raster::*;
fn shot(verts:&[Vec<P3>], faces:&[Vec<[u32;3]>], cols:&[[f32;3]], yaw:f32, w:u32,h:u32, bounds:(P3,P3)) -> Vec<u8> {
    let (s,c)=yaw.sin_cos();
    let mut all=vec![]; let mut f=vec![]; let mut owner=vec![];
    for (k,v) in verts.iter().enumerate(){ let o=all.len() as u32; for p in v { let x=c*p.x - s*p.z; let z=s*p.x + c*p.z; all.push(P3::new(x,-p.y,-z)); } for t in &faces[k]{ f.push([t[0]+o,t[1]+o,t[2]+o]); owner.push(k);} }
    // smooth normals
    let mut nrm=vec![V3::zeros(); all.len()];
    for t in &f { let n=(all[t[1] as usize]-all[t[0] as usize]).cross(&(all[t[2] as usize]-all[t[0] as usize])); for v in t {nrm[*v as usize]+=n;} }
    let cx=(bounds.0.x+bounds.1.x)/2.0; let cz=(bounds.0.z+bounds.1.z)/2.0; let mx=c*cx - s*cz;
    let ppm=h as f32/((bounds.1.y-bounds.0.y)*1.04);
    let view=View::Orthographic{width:w,height:h,left:mx-(w as f32)/ppm/2.0,top:-bounds.1.y-0.02*(bounds.1.y-bounds.0.y),pixels_per_metre:ppm};
    let mut b=VisibilityBuffer::default(); rasterise(&view,&all,&f,&mut b);
    let mut out=vec![255u8;(w*h*3) as usize];
    for i in 0..(w*h) as usize { let id=b.face[i]; if id==u32::MAX {continue;}
        let t=f[id as usize]; let col=cols[owner[id as usize]];
        let (u,v)=((i as u32%w) as f32,(i as u32/w) as f32);
        let q=t.map(|j| view.project(&all[j as usize]).unwrap());
        let ar=(q[1][0]-q[0][0])*(q[2][1]-q[0][1])-(q[1][1]-q[0][1])*(q[2][0]-q[0][0]);
        let w0=((q[2][0]-q[1][0])*(v-q[1][1])-(q[2][1]-q[1][1])*(u-q[1][0]))/ar; let w1=((q[0][0]-q[2][0])*(v-q[2][1])-(q[0][1]-q[2][1])*(u-q[2][0]))/ar; let w2=1.0-w0-w1;
        let n=(nrm[t[0] as usize]*w0+nrm[t[1] as usize]*w1+nrm[t[2] as usize]*w2).normalize();
        let fnn=(all[t[1] as usize]-all[t[0] as usize]).cross(&(all[t[2] as usize]-all[t[0] as usize]));
        let back = fnn.z>0.0; let n=if n.z>0.0 {-n} else {n};
        let l=V3::new(-0.5,-0.6,-0.7).normalize(); let sh=0.25+0.75*n.dot(&l).max(0.0);
        for k in 0..3 { let c=if back&&owner[id as usize]>0 {col[(k+1)%3]*0.5} else {col[k]}; out[i*3+k]=(c*sh*255.0).clamp(0.,255.) as u8; } }
    out
}
fn main(){
    let args:Vec<String>=std::env::args().collect();
    let body=&args[1]; let garments:Vec<&str>=args[2].split(',').collect(); let motion=&args[3]; let out=&args[4]; let size=args.get(5).cloned();
    let (template,shape)= if body=="embedded" {(tryon::body::embedded::template(), BodyShape::default())} else { let a=tryon::formats::npz::read_smpl(std::path::Path::new(body)).unwrap(); (std::sync::Arc::new(tryon::body::import::template_from_smpl("b",&a).unwrap()), BodyShape::default()) };
    let rest=template.personalise(&shape);
    let m=measure(&template,&rest); println!("{m:?}");
    let sk=template.skeleton();
    let root=Rigid::<World,Body>::identity();
    let pose_at=|t:f64|->Pose<World>{
        let mut p=Pose::rest(sk,root);
        // arms down relative to rest: rotate shoulder so arm points at given angle
        let mut aim=|p:&mut Pose<World>,side:&str,down:f64,fwd:f64|{ let s=if side=="left"{1.0}else{-1.0};
            let (j,c)=(sk.index(&format!("{side}_shoulder")).unwrap(),sk.index(&format!("{side}_elbow")).unwrap());
            let now=rest.joints[c]-rest.joints[j]; let w=nalgebra::Vector3::new(s*down.cos()*fwd.cos(),-down.sin(),fwd.sin()*down.cos());
            let q=nalgebra::UnitQuaternion::rotation_between(&now,&w).unwrap(); let at=sk.dof_offset(j); let l=log_so3(&q); if sk.joints()[j].motion.dofs()==3 {p.angles[at..at+3].copy_from_slice(l.as_slice());} };
        let set=|p:&mut Pose<World>,n:&str,v:[f64;3]|{ p.set(sk,n,&v); };
        match motion.as_str(){
          "rest"=>{}
          "down"=>{aim(&mut p,"left",1.25,0.0);aim(&mut p,"right",1.25,0.0);}
          "arms"=>{let a=1.25-2.2*(0.5-0.5*(t*3.0).cos());aim(&mut p,"left",a,0.0);aim(&mut p,"right",a,0.0);}
          "twist"=>{aim(&mut p,"left",1.1,0.0);aim(&mut p,"right",1.1,0.0);let y=0.5*(t*4.0).sin();set(&mut p,"spine1",[0.0,y,0.0]);set(&mut p,"spine3",[0.0,y,0.0]);}
          "walk"=>{let a=0.5*(t*6.0).sin();aim(&mut p,"left",1.2,0.0);aim(&mut p,"right",1.2,0.0);
             let hb=|p:&mut Pose<World>,n:&str,x:f64|{ if let Some(j)=sk.index(n){ let at=sk.dof_offset(j); p.angles[at]=x; }};
             hb(&mut p,"left_hip",-a-0.2);hb(&mut p,"right_hip",a-0.2);hb(&mut p,"left_knee",0.3+0.3*(t*6.0).cos());hb(&mut p,"right_knee",0.3-0.3*(t*6.0).cos());}
          "squat"=>{let a=1.0*(0.5-0.5*(t*3.0).cos());aim(&mut p,"left",0.5,0.8);aim(&mut p,"right",0.5,0.8);
             for s in ["left","right"]{ p.set(sk,&format!("{s}_hip"),&[-1.3*a,0.0,0.0]);p.set(sk,&format!("{s}_knee"),&[1.7*a,0.0,0.0]);} }
          _=>panic!()
        } p };
    let mut pats=vec![];
    for g in &garments { let s:Size=match &size {Some(s)=>s.parse().unwrap(),None=>{let s=suggest(g,&m).unwrap();println!("{g}: {}",s.reason);s.size}}; pats.push(library::pattern(g,s).unwrap()); }
    let d=dress(&template,&rest,&pose_at(0.0),&pats,&DressOptions::default()).unwrap();
    println!("{:?}",d.report);
    let (model,mut state)=(d.model,d.state);
    let mut ws=Workspace::default();
    let frames:usize=args.get(6).map_or(60,|s|s.parse().unwrap());
    let cols=[[0.85,0.68,0.58],[0.25,0.35,0.75],[0.8,0.25,0.25],[0.3,0.6,0.3]];
    let (w,h)=(420u32,640u32);
    let mut strip:Vec<Vec<u8>>=vec![]; let mut tot=0.0; let mut worst:f64=0.0;
    let shots:Vec<usize>=if frames<2 {vec![0]} else {vec![frames/3,2*frames/3,frames-1]};
    for i in 0..frames.max(1) {
        let p=pose_at(i as f64/30.0); let mut b=BoneTransforms::default(); p.bones(sk,&rest,&mut b); let mut v=vec![]; skin(tryon::par::Par::Rayon,&rest.vertices,template.weights(),&b,&mut v);
        if frames>0 { let r=step(&model,&mut state,&Input{body:&v,dt:1.0/30.0},&mut ws).unwrap(); tot+=r.stages_ms.total; worst=worst.max(r.penetration_left); if i%15==0 {println!("{i} {r:?}");} }
        if shots.contains(&i) || frames==0 {
            let mut vs=vec![v.clone()]; let mut fs=vec![template.mesh().faces().to_vec()];
            for (k,g) in state.garments.iter().enumerate(){ vs.push(g.positions.clone()); fs.push(model.outfit.garments[k].faces.clone()); }
            let lo=v.iter().fold(P3::new(9.,9.,9.),|a,p|a.inf(p)); let hi=v.iter().fold(P3::new(-9.,-9.,-9.),|a,p|a.sup(p));
            let views:Vec<Vec<u8>>=[0.0,0.785,1.571,3.1416].iter().map(|y| shot(&vs,&fs,&cols,*y,w,h,(lo,hi))).collect();
            let mut row=vec![0u8;(w*h*3*4) as usize];
            for y in 0..h as usize { for (k,im) in views.iter().enumerate(){ let o=(y*4+k)*(w as usize)*3; row[o..o+w as usize*3].copy_from_slice(&im[y*w as usize*3..(y+1)*w as usize*3]); } }
            strip.push(row);
        }
    }
    println!("mean {:.2} ms, penetration left {:.4}; verts {:?}", tot/frames.max(1) as f64, worst, state.garments.iter().map(|g|g.positions.len()).collect::<Vec<_>>());
    let all: Vec<u8> = strip.concat();
    tryon::formats::image::write_png_rgb(std::path::Path::new(out), &tryon::camera::ColorImage::new(w*4, h*strip.len() as u32, all).unwrap()).unwrap();
}
